// SPDX-License-Identifier: Apache-2.0
// Runs the Python package shadowdag_report, which makes every page and chart from the data that the
// program writes.
#pragma once

#include "tools/settings/console.h"
#include "tools/settings/json.h"

#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Begins a line of progress: the record separator of ASCII.
constexpr char kProgressMark = '\x1e';

/// The package, found and complete.
class ReportPackage {
public:
    /// If `drawsCharts`, throws Error kUsage when the package, Python, Jinja2 or matplotlib is
    /// missing, with the packages to install; call it before any long work. Otherwise missing
    /// packages are reported as a note, and pages are omitted. Throws Error kResource where Python
    /// or a package is there and cannot be loaded. @param remedy another remedy; "" for none
    ReportPackage(bool drawsCharts, const Console& console,
                  const std::string& remedy = "pass --no-charts");
    /// Returns the package for pages alone. Throws Error kUsage when it is missing, or Python or
    /// Jinja2. @param remedy another remedy
    static ReportPackage forPages(const std::string& remedy);

    /// Writes DIRECTORY/index.html, and, if charts are drawn, DIRECTORY/charts, from the data in
    /// the directory. Returns charts.json, the list of charts with captions and of those omitted
    /// for lack of data. Throws as runReportPackage does, and Error kResource if the package ends
    /// without a page.
    /// @param name the package's command: compare, failures, stability, ablation, real
    Json writePage(const std::string& name, const std::string& directory) const;
    /// Returns whether writePage writes a page.
    bool hasPage() const { return !path_.empty(); }
    /// Runs any command of the package. Throws as runReportPackage does.
    void run(const std::vector<std::string>& arguments) const;

private:
    explicit ReportPackage(const std::string& remedy);

    std::string path_; ///< "" if pages are omitted
    bool drawsCharts_;
    std::optional<Console> console_; ///< shows how many charts are drawn
};

/// Runs the package at a path. Throws Error kInput when it refused the data, kResource with its
/// last lines when it fails or cannot write.
/// @param arguments the command and its arguments
/// @param progress receives the share of charts that are drawn; may be empty
void runReportPackage(const std::string& path, const std::vector<std::string>& arguments,
                      const Progress& progress = {});

/// Returns one line for each omitted chart of charts.json, with the data that it needs.
std::vector<std::string> leftOutLines(const Json& charts);

/// Runs a program to its end, with empty standard input; returns its exit status, 128 + the signal
/// that ended it, or 127 when there is none. Throws Error kResource where the system refuses the
/// files, the memory or the process.
/// @param errorText receives its standard output and standard error in order; null discards them
/// @param progress if not empty, the program has SHADOWDAG_PROGRESS=1 in its environment, and of
/// the lines that begin with kProgressMark the number after it is reported and not kept
int runProgram(const std::vector<std::string>& arguments, std::string* errorText = nullptr,
               const Progress& progress = {});

/// Returns the directory of the running program.
std::string programDirectory();

} // namespace shadowdag
