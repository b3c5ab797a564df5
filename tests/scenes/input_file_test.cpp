// SPDX-License-Identifier: Apache-2.0
#include "scenes/input_file.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/warning.h"
#include "tests/tools/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

namespace shadowdag {
namespace {

using testing::HasSubstr;

std::string reasonOf(const std::string& path, const InputLimits& limits) {
    std::string why;
    return readInput(path, limits, why) ? "read" : why;
}

TEST(InputFile, RegularFilesAreReadWithinTheirLimit) {
    const TemporaryDirectory directory;
    for (const size_t size : {size_t(0), size_t(1), size_t(4096), size_t(3'000'001)}) {
        std::string content(size, 'x');
        for (size_t i = 0; i < size; ++i)
            content[i] = char(i * 31);
        writeText(directory / "a", content);
        std::string why;
        EXPECT_EQ(readInput(directory / "a", {size}, why), content);
        EXPECT_EQ(whyNoInput(directory / "a", size), size > 0 ? "" : "has a size of 0 bytes");
        if (size > 0) {
            EXPECT_THAT(reasonOf(directory / "a", {size - 1}),
                        HasSubstr("at most " + std::to_string(size - 1) + " are read"));
            EXPECT_THAT(whyNoInput(directory / "a", size - 1), HasSubstr("are read"));
        }
    }
}

TEST(InputFile, OtherThingsThanFilesAreRefusedBeforeTheyAreRead) {
    const TemporaryDirectory directory;
    ASSERT_EQ(mkfifo((directory / "pipe").c_str(), 0600), 0);
    for (const bool mayBePipe : {false, true}) {
        EXPECT_EQ(reasonOf("/dev/zero", {100, mayBePipe}), "is a device");
        EXPECT_EQ(reasonOf(directory.path(), {100, mayBePipe}), "is a directory");
        EXPECT_THAT(reasonOf(directory / "none", {100, mayBePipe}),
                    HasSubstr("cannot be opened: No such file"));
    }
    EXPECT_THAT(reasonOf(directory / "pipe", {100}), HasSubstr("is a pipe"));
    writeText(directory / "a", "content");
    using namespace std::string_literals;
    EXPECT_THAT(reasonOf(directory / "a\0b"s, {100}), HasSubstr("cannot be opened"));
    EXPECT_EQ(whyNoInput("/dev/zero", 100), "is a device");
    EXPECT_THAT(whyNoInput(directory / "none", 100), HasSubstr("cannot be opened"));
}

TEST(InputFile, PipesAreReadToTheirEndWithinTheLimit) {
    const TemporaryDirectory directory;
    const std::string pipe = directory / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const std::string content(200'000, 'y');
    for (const bool isTooLong : {false, true}) {
        std::thread writer([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(20)); // opened before it writes
            std::ofstream out(pipe);
            out << content << std::flush;
        });
        std::string why;
        const auto found = readInput(pipe, {isTooLong ? 199'999u : 200'000u, true}, why);
        if (isTooLong)
            EXPECT_THAT(why, HasSubstr("has more than the 199999 bytes"));
        else
            EXPECT_EQ(found, content);
        writer.join();
    }
}

TEST(InputFile, WaitingForAPipeCanBeCancelled) {
    const TemporaryDirectory directory;
    const std::string pipe = directory / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    struct Cancelled {};
    static int pollCount;
    pollCount = 0;
    setCpuPoll([](double) {
        if (++pollCount > 3)
            throw Cancelled();
    });
    std::string why;
    EXPECT_THROW(readInput(pipe, {100, true}, why), Cancelled);
    setCpuPoll(nullptr);
}

TEST(InputFile, APipeIntoWhichNobodyWritesIsAWarning) {
    const TemporaryDirectory directory;
    const std::string pipe = directory / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    struct Cancelled {};
    static std::vector<std::string> warnings;
    static std::chrono::steady_clock::time_point end;
    warnings.clear();
    end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    setWarningListener([](const std::string& text) { warnings.push_back(text); });
    setCpuPoll([](double) {
        if (std::chrono::steady_clock::now() > end)
            throw Cancelled();
    });
    std::string why;
    EXPECT_THROW(readInput(pipe, {100, true}, why), Cancelled);
    setCpuPoll(nullptr);
    setWarningListener(nullptr);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], HasSubstr(pipe + ": is a pipe into which nothing was written yet"));
}

TEST(InputFile, TooManyOpenFilesAreNotBlamedOnTheFile) {
    const TemporaryDirectory directory;
    writeText(directory / "a", "content");
    rlimit before{};
    getrlimit(RLIMIT_NOFILE, &before);
    rlimit none = before;
    none.rlim_cur = 0;
    setrlimit(RLIMIT_NOFILE, &none);
    std::vector<std::string> messages;
    for (const bool polls : {true, false})
        try {
            std::string why;
            readInput(directory / "a", {100, false, polls}, why);
        } catch (const TooManyFiles& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            messages.emplace_back(error.what());
        }
    setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_EQ(messages.size(), 2u);
    EXPECT_THAT(messages, testing::Each(HasSubstr("Too many open files; raise the limit")));
}

} // namespace
} // namespace shadowdag
