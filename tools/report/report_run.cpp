// SPDX-License-Identifier: Apache-2.0
#include "tools/report/report_run.h"

#include "scenes/output_file.h"

namespace shadowdag {

void writeWholeFile(const std::string& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

ReportRun::ReportRun(const std::string& directory, const std::string& name, const Console& console,
                     bool drawsCharts)
    : name_(name), directory_(directory), partial_(directory + "/partial"),
      package_(drawsCharts, console), held_(directory, false, false),
      journal_(partial_ + "/journal.json", name, false), bar_(console.progress("compare " + name)) {
}

std::function<void(double)> ReportRun::progress() const {
    return [this](double share) {
        checkInterrupted();
        if (bar_)
            bar_(share);
    };
}

std::string ReportRun::publish() const {
    package_.writePage(name_, partial_);
    checkInterrupted();
    swapReport(directory_);
    return directory_ + "/" + (package_.hasPage() ? "index.html" : name_ + ".json");
}

double ReportRun::wallSeconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

} // namespace shadowdag
