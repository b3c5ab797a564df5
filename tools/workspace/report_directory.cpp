// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "scenes/output_file.h"
#include "tools/settings/json.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <unistd.h>
#include <vector>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// What a compare leaves in its directory, in the order in which it is put there.
constexpr const char* kReportParts[] = {
    "images",        "charts",        "results.json",    "results.csv",   "lights.csv",
    "costs.json",    "index.html",    "experiment.json", "part.json",     "sequence.csv",
    "failures.json", "failures.csv",  "stability.json",  "stability.csv", "real.json",
    "real.csv",      "ablation.json", "ablation.csv"};

/// Returns whether a file is JSON with these keys, as our own files are.
bool holdsKeys(const std::string& path, const std::vector<const char*>& keys) {
    std::ifstream file(path, std::ios::binary);
    const Json json = file ? Json::parse(file, nullptr, false) : Json();
    return json.is_object() && std::all_of(keys.begin(), keys.end(),
                                           [&](const char* key) { return json.contains(key); });
}

/// Throws Error kUsage when the directory holds anything of a report's names that no compare made.
void refuseForeignFiles(const std::string& directory) {
    std::error_code ignored;
    if (holdsKeys(directory + "/results.json", {"provenance", "experiment", "runs"}) ||
        holdsKeys(directory + "/part.json", {"provenance", "experiment", "runs"}) ||
        holdsKeys(directory + "/failures.json", {"provenance", "cells", "remedies"}) ||
        holdsKeys(directory + "/stability.json", {"provenance", "checks", "rates"}) ||
        holdsKeys(directory + "/real.json", {"provenance", "cells", "frame_count"}) ||
        holdsKeys(directory + "/ablation.json", {"provenance", "mechanisms"}) ||
        holdsKeys(directory + "/partial/journal.json", {"key", "parts"}))
        return;
    const std::string journal = directory + "/partial/journal.json";
    if (std::ifstream file(journal, std::ios::binary);
        file && Json::parse(file, nullptr, false).is_discarded())
        throw Error(ErrorKind::kInput, journal +
                                           ": is damaged or cut short, so that nothing tells "
                                           "whether what lies beside it is a compare's; "
                                           "delete " +
                                           directory + "/partial to measure anew");
    const auto refuse = [&](const std::string& name) {
        throw Error(ErrorKind::kUsage, "-o '" + directory + "': holds " + name +
                                           ", which no compare made and which a report would "
                                           "replace; name an empty or a new directory");
    };
    for (const char* name : kReportParts)
        if (fs::exists(directory + "/" + name, ignored))
            refuse(name);
    if (fs::exists(directory + "/partial", ignored))
        for (const auto& entry : fs::recursive_directory_iterator(directory + "/partial", ignored))
            if (!entry.is_directory(ignored))
                refuse("partial");
}

void moveFile(const std::string& from, const std::string& to) {
    std::error_code failed;
    fs::rename(from, to, failed);
    if (failed)
        throw Error(ErrorKind::kResource,
                    from + ": cannot be moved to " + to + ": " + failed.message());
}

/// Puts the older report back where a swap was left half done. What was new goes back to `partial`.
void undoSwap(const std::string& directory) {
    const std::string partial = directory + "/partial", old = partial + "/old";
    if (!fs::exists(old))
        return;
    for (const char* name : kReportParts) {
        const std::string target = directory + "/" + name, fresh = partial + "/" + name;
        const bool wasThere = fs::exists(old + "/" + name);
        // Without charts nothing was put where they would be.
        const bool isFresh = wasThere || (!fs::exists(fresh) && std::string(name) != "charts");
        if (isFresh && fs::exists(target))
            moveFile(target, fresh);
        if (wasThere)
            moveFile(old + "/" + name, target);
    }
    fs::remove_all(old);
}

/// Throws Error kUsage when the directory holds a report and a part is to come, or the reverse:
/// what takes the place of the other would not be put back whole if the swap died.
void refuseOtherKind(const std::string& directory, bool isPart) {
    const char* other = isPart ? "results.json" : "part.json";
    if (fs::exists(directory + "/" + other))
        throw Error(ErrorKind::kUsage, "-o '" + directory + "': holds " +
                                           (isPart ? "a whole report" : "a part of a compare") +
                                           " (" + other + "); name another directory for " +
                                           (isPart ? "a part" : "a report"));
}

} // namespace

DirectoryGuard::DirectoryGuard(const std::string& directory) {
    std::error_code ignored;
    for (fs::path path = fs::path(directory).lexically_normal(); !path.empty();
         path = path.parent_path()) {
        if (!path.has_filename()) { // of "a/", and the root
            if (path == path.parent_path())
                break;
            continue;
        }
        if (fs::symlink_status(path, ignored).type() != fs::file_type::not_found)
            break; // a link that leads nowhere is there, too
        fresh_.push_back(path.string());
    }
}

DirectoryGuard::~DirectoryGuard() {
    for (const std::string& path : fresh_)
        static_cast<void>(rmdir(path.c_str())); // stays where it is not empty
}

ReportDirectory::ReportDirectory(const std::string& directory, bool resume, bool isPart)
    : partial_(directory + "/partial"), guard_(directory) {
    lock_.emplace(prepareDirectory(directory, resume, isPart));
}

ReportDirectory::~ReportDirectory() {
    std::error_code ignored;
    if (fs::exists(partial_ + "/old", ignored))
        return; // a swap that could not be undone keeps the older report
    std::ifstream file(partial_ + "/journal.json", std::ios::binary);
    const bool hasJournal = bool(file); // --join has none
    const Json journal = hasJournal ? Json::parse(file, nullptr, false) : Json();
    const bool isEmpty =
        journal.is_object() && journal.contains("parts") && journal["parts"].empty();
    if (!hasJournal || isEmpty)
        fs::remove_all(partial_, ignored);
}

DirectoryLock prepareDirectory(const std::string& directory, bool resume, bool isPart) {
    std::error_code failed;
    if (fs::exists(directory) && !fs::is_directory(directory))
        throw Error(ErrorKind::kResource, directory + ": is a file; give the name of a directory");
    const auto create = [&](const std::string& path) {
        fs::create_directories(path, failed);
        if (failed)
            throw Error(ErrorKind::kResource, path + ": cannot be created: " + failed.message() +
                                                  "; choose another directory");
    };
    create(directory);
    DirectoryLock lock("-o", directory);
    refuseForeignFiles(directory);
    undoSwap(directory);
    refuseOtherKind(directory, isPart);
    if (!resume)
        fs::remove_all(directory + "/partial", failed);
    create(directory + "/partial/images");
    OutputFile probe(directory + "/partial/probe"); // removed again: never committed
    return lock;
}

void swapReport(const std::string& directory) {
    const std::string partial = directory + "/partial", old = partial + "/old";
    fs::create_directories(old);
    try {
        for (const char* name : kReportParts) {
            const std::string target = directory + "/" + name, fresh = partial + "/" + name;
            if (fs::exists(target))
                moveFile(target, old + "/" + name);
            if (fs::exists(fresh))
                moveFile(fresh, target);
        }
    } catch (...) {
        undoSwap(directory);
        throw;
    }
    moveFile(old, partial + "/done"); // from here on nothing is taken back
    std::error_code ignored;
    fs::remove_all(partial, ignored);
}

} // namespace shadowdag
