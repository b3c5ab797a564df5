// SPDX-License-Identifier: Apache-2.0
// Runs the program while calls fail, the clock runs backwards or the process is killed, and
// compares what it leaves with what whole runs leave.
#pragma once

#include "tests/hybrid/random.h"
#include "tests/tools/program/program_runner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#if !defined(SDAG_FAULT_LIBRARY)
/// The library of fault_library.cpp: the targets define where it was built.
#define SDAG_FAULT_LIBRARY "libfault_library.so"
/// The program of remove_abandoned.cpp.
#define SDAG_REMOVE_ABANDONED "remove_abandoned"
#endif

namespace shadowdag::test {

/// Returns how many times as much the tests do: SDAG_FAULT_ROUNDS in the environment, else 1.
inline size_t faultRounds() {
    const char* const text = std::getenv("SDAG_FAULT_ROUNDS");
    return text ? std::max<size_t>(1, std::strtoul(text, nullptr, 10)) : 1;
}

/// Returns the seed of a run: SDAG_FAULT_SEED in the environment, else a new one. Tests print it.
inline uint64_t faultSeed() {
    const char* const text = std::getenv("SDAG_FAULT_SEED");
    return text ? std::strtoull(text, nullptr, 10) : std::random_device()();
}

/// Prints and records how many faults, kills or signals a test has tried; tests/faults/measure.py
/// reads it.
inline void recordFaults(size_t count, uint64_t seed) {
    std::cout << count << " tried, seed " << seed << std::endl;
    testing::Test::RecordProperty("tried_count", std::to_string(count));
    testing::Test::RecordProperty("seed", std::to_string(seed));
}

/// Returns all of 1..count, or `most` different ones of them, with the first and the last.
inline std::set<long> someNumbers(long count, size_t most, Random& random) {
    std::set<long> numbers;
    if (count > 0)
        numbers = {1, count};
    while (numbers.size() < std::min(most, size_t(count)))
        numbers.insert(1 + random.below(size_t(count)));
    return numbers;
}

/// Returns the words that start a program with the library of faults. A run that hangs is ended
/// after a minute (status 124, which no other run has), by a signal that it does not catch.
inline Arguments withFault(const std::string& fault, const std::string& countsPath = "") {
    Arguments words = {
        "/usr/bin/timeout",   "-s", "USR1", "60", "/usr/bin/env", "LD_PRELOAD=" SDAG_FAULT_LIBRARY,
        "SDAG_FAULT=" + fault};
    if (!countsPath.empty())
        words.push_back("SDAG_FAULT_COUNTS=" + countsPath);
    return words;
}

/// Returns how often a run calls each function: of its processes the one that calls it most.
inline std::map<std::string, long> countCalls(const TemporaryDirectory& directory,
                                              const Arguments& arguments) {
    const std::string path = directory / "counts";
    std::filesystem::remove(path);
    runShadowdag(directory, arguments, withFault("", path));
    std::istringstream text(readText(path));
    std::map<std::string, long> counts;
    long count = 0;
    for (std::string name; text >> name >> count;)
        counts[name] = std::max(counts[name], count);
    return counts;
}

/// Removes the values of a report that differ between equal runs: times, and what follows from
/// them.
inline void removeTimes(Json& json) {
    static const std::set<std::string> kNames = {"provenance",   "whole_frame",  "verdict",
                                                 "rays_scale",   "maps_scale",   "other_cpu_share",
                                                 "frames_per_s", "content_hash", "shown_as"};
    if (json.is_object()) {
        for (auto entry = json.begin(); entry != json.end();)
            if (const std::string& key = entry.key();
                kNames.contains(key) || key.starts_with("time_over") ||
                key.find("_ms") != std::string::npos || key.ends_with("_s"))
                entry = json.erase(entry);
            else
                ++entry;
    }
    if (json.is_structured()) {
        for (Json& value : json)
            removeTimes(value);
    }
}

/// Returns a page with '~' for each text between its tags: some say which method was the fastest.
inline std::string withoutTexts(const std::string& page) {
    std::string result;
    bool isTag = false;
    for (const char c : page) {
        isTag = isTag || c == '<';
        if (isTag)
            result += c;
        else if (!result.ends_with('~'))
            result += '~';
        isTag = isTag && c != '>';
    }
    return result;
}

/// Returns a page with "<chart>" for each chart, whose points, ticks and marks follow the times.
inline std::string withoutCharts(std::string page) {
    const std::string_view first = "<svg", last = "</svg>";
    for (size_t begin; (begin = page.find(first)) != std::string::npos;) {
        const size_t end = page.find(last, begin);
        page.replace(begin, end == std::string::npos ? end : end + last.size() - begin, "<chart>");
    }
    return page;
}

/// Returns a text with '#' for each number: pages and tables hold times beside what the JSON holds.
inline std::string withoutNumbers(const std::string& text) {
    std::string result;
    for (const char c : text) {
        const bool isDigit = c >= '0' && c <= '9', follows = result.ends_with('#');
        if (isDigit && !follows)
            result += '#';
        else if (!isDigit &&
                 !(follows && std::string_view(".e+-").find(c) != std::string_view::npos))
            result += c;
    }
    return result;
}

/// Returns what a file, or the files of a folder, hold, without times; "" if there is nothing. An
/// unfinished report's folder "partial" does not count.
inline std::string contentOf(const std::filesystem::path& path) {
    namespace fs = std::filesystem;
    if (fs::is_directory(path)) {
        std::set<fs::path> entries;
        for (const auto& entry : fs::directory_iterator(path))
            entries.insert(entry.path());
        std::string content;
        for (const fs::path& entry : entries)
            if (const std::string name = entry.filename(); name != "partial" && name[0] != '.')
                content += name + "\n" + contentOf(entry) + "\n";
        return content;
    }
    const std::string bytes = fs::exists(path) ? readText(path) : "";
    if (path.extension() == ".json") {
        Json json = Json::parse(bytes, nullptr, false);
        removeTimes(json);
        return json.dump();
    }
    if (path.extension() == ".html")
        return withoutNumbers(withoutTexts(withoutCharts(bytes)));
    return path.extension() == ".csv" ? withoutNumbers(bytes) : bytes;
}

/// Writes made-up results of compare --sequence for some variants.
inline void makeSequence(const std::string& path, const Arguments& variants) {
    std::string command = "/usr/bin/python3 " SDAG_SOURCE_DIR "/tests/tools/make_sequence.py c1";
    for (const std::string& variant : variants)
        command += " " + variant;
    ASSERT_EQ(std::system((command + " > " + path).c_str()), 0);
}

/// Returns the unfinished files in a folder and the folders in it, but for those that --resume
/// takes up.
inline std::string unfinishedFiles(const std::string& folder) {
    std::string names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (const std::string path = entry.path();
            path.find(".tmp-") != std::string::npos && path.find(".scratch/") == std::string::npos)
            names += path + " ";
    return names;
}

} // namespace shadowdag::test
