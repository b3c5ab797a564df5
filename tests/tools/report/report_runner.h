// SPDX-License-Identifier: Apache-2.0
// Runs the Python package of reports from the source tree.
#pragma once

#include "tests/tools/temporary_directory.h"
#include "tools/report/report_package.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

#if !defined(SDAG_SOURCE_DIR)
// Where the header is compiled alone.
#define SDAG_SOURCE_DIR "."
#endif

namespace shadowdag {

inline const std::string kReportPackage = SDAG_SOURCE_DIR "/tools/report/shadowdag_report";

/// Returns the package's exit status. @param said receives its output in order
inline int runReport(std::vector<std::string> arguments, std::string* said = nullptr) {
    arguments.insert(arguments.begin(), {"/usr/bin/python3", kReportPackage});
    return runProgram(arguments, said);
}

/// Returns the page that a command of the package makes, without charts, of a file of results.
inline std::string pageOf(const std::string& command, const std::string& file,
                          const Json& results) {
    const TemporaryDirectory directory;
    writeText(directory / file, results.dump());
    std::string said;
    EXPECT_EQ(runReport({command, directory.path(), "--no-charts"}, &said), 0) << said;
    return readText(directory / "index.html");
}

} // namespace shadowdag
