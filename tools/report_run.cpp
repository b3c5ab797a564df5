// SPDX-License-Identifier: Apache-2.0
#include "tools/report_run.h"

#include "scenes/output_file.h"

#include <filesystem>

namespace shadowdag {

void writeWholeFile(const std::string& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

ReportRun::ReportRun(const std::string& directory, const std::string& name, const Console& console)
    : directory_(directory), partial_(directory + "/partial"),
      isNew_(!std::filesystem::exists(directory)), lock_(prepareDirectory(directory, false, false)),
      journal_(partial_ + "/journal.json", name, false), bar_(console.progress("compare " + name)) {
}

ReportRun::~ReportRun() {
    std::error_code ignored;
    std::filesystem::remove_all(partial_, ignored); // gone already where it was published
    if (isNew_)
        std::filesystem::remove(directory_, ignored); // which only an empty one is
}

std::function<void(double)> ReportRun::progress() const {
    return [this](double share) {
        checkInterrupted();
        if (bar_)
            bar_(share);
    };
}

std::string ReportRun::publish() const {
    checkInterrupted();
    swapReport(directory_);
    return directory_ + "/index.html";
}

double ReportRun::wallSeconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

} // namespace shadowdag
