// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/fault_runner.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>
#include <utility>

namespace shadowdag {
namespace {

const std::pair<const char*, std::string> kFiles[] = {
    {"a.json", R"({"bytes": 7, "time_ms": 0.5})"},
    {"a.csv", "label,time_ms\nmaps,0.5\ndag,12e-05\n"},
    {"a.html", "<html><p>maps was the fastest, 0.5 ms</p></html>\n"},
    {"a.png", "\x89PNG 17 bytes"},
};

TEST(ContentOf, NoticesEveryTruncation) {
    for (const auto& [name, whole] : kFiles) {
        const TemporaryDirectory directory;
        const std::string path = directory / name;
        std::set<std::string> contents;
        for (size_t size = 0; size < whole.size(); ++size) {
            std::ofstream(path, std::ios::binary) << whole.substr(0, size);
            contents.insert(test::contentOf(path));
        }
        std::ofstream(path, std::ios::binary) << whole;
        EXPECT_FALSE(contents.contains(test::contentOf(path))) << name;
    }
}

TEST(ContentOf, CountsTheChartsOfAPage) {
    const std::string chart = "<svg width=\"7\"><path d=\"M 1 2\"/></svg>", text = "<p>a</p>";
    const std::string page = text + chart + chart;
    EXPECT_EQ(test::withoutCharts(page), text + "<chart><chart>");
    EXPECT_EQ(test::withoutCharts(page.substr(0, page.size() - 3)), text + "<chart><chart>");
    EXPECT_EQ(test::withoutCharts(text), text);
}

TEST(ContentOf, IsThatOfEqualRunsWithOtherTimes) {
    const TemporaryDirectory directory;
    for (const auto& [name, one] : kFiles) {
        std::string other = one;
        if (const size_t time = other.find("0.5"); time != std::string::npos)
            other.replace(time, 3, "7.1e-05");
        if (const size_t fastest = other.find("maps was"); fastest != std::string::npos)
            other.replace(fastest, 4, "dag");
        std::ofstream(directory / name, std::ios::binary) << one;
        const std::string content = test::contentOf(directory / name);
        std::ofstream(directory / name, std::ios::binary) << other;
        EXPECT_EQ(test::contentOf(directory / name), content) << name;
    }
}

} // namespace
} // namespace shadowdag
