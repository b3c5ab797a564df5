// SPDX-License-Identifier: Apache-2.0
// A compare that writes one report: its directory from the lock to the swap, its page, its progress
// and time.
#pragma once

#include "tools/report/report_package.h"
#include "tools/settings/console.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/report_directory.h"

#include <chrono>
#include <functional>
#include <string>

namespace shadowdag {

/// Writes a whole file or none; throws as OutputFile does.
void writeWholeFile(const std::string& path, const std::string& text);

/// What lies under partial() takes the place of the report at publish(), whole; until then the old
/// report stays. Not published, it takes partial() away again: nothing in it could be resumed.
class ReportRun {
public:
    /// Finds the package as ReportPackage does; locks and prepares the directory as
    /// prepareDirectory does.
    /// @param name as in `compare NAME`; the package's command and the results' NAME.json
    ReportRun(const std::string& directory, const std::string& name, const Console& console,
              bool drawsCharts = false);

    /// Returns where the report is written: DIR/partial.
    const std::string& partial() const { return partial_; }
    /// Returns what shows a share done, 0 to 1, and throws where the program was interrupted.
    std::function<void(double)> progress() const;
    /// Writes a file under partial().
    void write(const std::string& name, const std::string& text) const {
        writeWholeFile(partial_ + "/" + name, text);
    }
    /// Makes the page and charts of what was written and puts the report in place; returns the path
    /// of its index.html, or of its results where the page is left out.
    std::string publish() const;
    /// Returns the seconds since the run began.
    double wallSeconds() const;

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::string name_, directory_, partial_;
    ReportPackage package_;
    ReportDirectory held_;
    Journal journal_; ///< tells a later compare that what lies in partial() is ours
    Progress bar_;
};

} // namespace shadowdag
