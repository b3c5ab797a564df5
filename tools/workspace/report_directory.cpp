// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "scenes/output_target.h"
#include "scenes/write_remedy.h"
#include "tools/settings/json_file.h"
#include "tools/workspace/study_kinds.h"
#include "tools/workspace/whole_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iterator>
#include <set>
#include <unistd.h>
#include <vector>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// Returns the files of compare and studies in their directory, in the order in which they are
/// moved there.
const std::vector<std::string>& reportParts() {
    static const std::vector<std::string> kParts = [] {
        std::vector<std::string> parts = {
            "images",     "charts",     "results.json",    "results.csv", "lights.csv",
            "costs.json", "index.html", "experiment.json", "part.json",   "sequence.csv"};
        for (const std::string kind : kStudyKinds)
            parts.insert(parts.end(), {kind + ".json", kind + ".csv"});
        return parts;
    }();
    return kParts;
}

/// Returns whether JSON is an object with these keys, as in our own files.
bool holdsKeys(const Json& json, const std::vector<const char*>& keys) {
    return json.is_object() && std::all_of(keys.begin(), keys.end(),
                                           [&](const char* key) { return json.contains(key); });
}

[[noreturn]] void refuseForeign(const std::string& directory, const std::string& name) {
    throw Error(ErrorKind::kUsage,
                "-o '" + directory + "': contains " + name +
                    ", which shadowdag did not write and which a report would replace; move it "
                    "elsewhere, or choose an empty or a new directory");
}

/// Throws Error kInput if a JSON file of the directory is damaged. @param remedy begins with what
/// to delete
void refuseDamaged(const std::string& directory, const std::string& name,
                   const std::string& remedy) {
    if (readOwnJsonFile(directory + "/" + name).is_discarded())
        throw Error(ErrorKind::kInput, directory + "/" + name +
                                           ": is damaged or truncated, so it is unknown whether "
                                           "shadowdag wrote the files beside it; delete " +
                                           directory + remedy);
}

/// Returns which of reportParts() belong to the reports, and parts of one, in a directory.
std::set<std::string> ownParts(const std::string& directory) {
    const auto read = [&](const std::string& name) {
        return readOwnJsonFile(directory + "/" + name);
    };
    std::set<std::string> own;
    for (const char* of : {"results.json", "part.json"}) {
        const Json json = read(of);
        if (!holdsKeys(json, {"provenance", "experiment", "runs"}))
            continue;
        own.insert({of, "results.csv", "lights.csv", "experiment.json"});
        if (json.contains("sequence_runs") && !json["sequence_runs"].empty())
            own.insert("sequence.csv");
        if (holdsKeys(read("costs.json"), {"costs"}))
            own.insert("costs.json");
    }
    for (const std::string kind : kStudyKinds)
        if (holdsKeys(read(kind + ".json"), {"provenance"}))
            own.insert({kind + ".json", kind + ".csv"});
    if (!own.empty())
        own.insert({"images", "charts", "index.html"});
    return own;
}

/// Throws Error kUsage if `partial` is there and this program did not write it; kInput if its
/// journal is damaged.
void refuseForeignPartial(const std::string& directory) {
    std::error_code ignored;
    const fs::file_status partial = fs::symlink_status(directory + "/partial", ignored);
    if (!fs::exists(partial) ||
        holdsKeys(readOwnJsonFile(directory + "/partial/journal.json"), {"key", "parts"}))
        return;
    if (!fs::is_directory(partial))
        refuseForeign(directory, "partial");
    refuseDamaged(directory, "partial/journal.json", "/partial to measure again");
    if (holdsReport(directory) || fs::exists(directory + "/partial/old") ||
        fs::exists(directory + "/partial/done")) {
        // Of a run that was killed before its journal, or of --join, which has none.
        const std::vector<std::string>& parts = reportParts();
        for (const auto& entry : fs::directory_iterator(directory + "/partial", ignored)) {
            const std::string name = entry.path().filename().string();
            if (name != "old" && name != "done" && name != "fresh.json" && !isTemporaryName(name) &&
                std::find(parts.begin(), parts.end(), name) == parts.end())
                refuseForeign(directory, "partial/" + name);
        }
        return;
    }
    for (const auto& entry : fs::recursive_directory_iterator(directory + "/partial", ignored))
        if (!entry.is_directory(ignored))
            refuseForeign(directory, "partial");
}

/// Returns the text of all files of a report that name its pictures and charts.
std::string namingText(const std::string& directory) {
    std::string text, ignored;
    for (const std::string& name : reportParts())
        if (name.ends_with(".json") || name.ends_with(".html"))
            text += readInput(directory + "/" + name, {kMaxOwnJsonBytes}, ignored).value_or("");
    return text +
           readInput(directory + "/charts/charts.json", {kMaxOwnJsonBytes}, ignored).value_or("");
}

/// Throws Error kUsage if the directory contains a file, at a report's place or in its folders,
/// that this program did not write: a report's pictures, and its charts up to the extension, are
/// named by its JSON files or its page.
void refuseForeignFiles(const std::string& directory) {
    std::error_code ignored;
    const std::set<std::string> own = ownParts(directory);
    if (own.empty() && holdsTracerRows(directory))
        throw Error(ErrorKind::kUsage, "-o '" + directory +
                                           "': holds the rows of tracers that rays wrote, whose "
                                           "page a report would replace; choose another directory");
    if (own.empty())
        for (const std::string& name : reportParts())
            if (name.ends_with(".json"))
                refuseDamaged(directory, name,
                              "/" + name + " if you do not need it, or choose another directory");
    for (const std::string& name : reportParts()) {
        const std::string path = directory + "/" + name;
        const bool isFolder = name == "images" || name == "charts";
        if (fs::exists(fs::symlink_status(path, ignored)) &&
            (!own.contains(name) || fs::is_directory(path, ignored) != isFolder))
            refuseForeign(directory, name);
    }
    std::string text;
    for (const char* folder : {"images", "charts"})
        for (fs::recursive_directory_iterator entry(directory + "/" + folder, ignored), end;
             entry != end; entry.increment(ignored)) {
            if (text.empty())
                text = namingText(directory);
            const fs::path& path = entry->path();
            const std::string name = std::string_view(folder) == "images"
                                         ? path.filename().string()
                                         : path.stem().string() + ".";
            if (entry->is_directory(ignored))
                refuseForeign(directory, fs::relative(path, directory, ignored).string());
            if (path.filename() != "charts.json" && text.find("\"" + name) == std::string::npos &&
                text.find("/" + name) == std::string::npos)
                refuseForeign(directory, fs::relative(path, directory, ignored).string());
        }
}

/// Throws Error kResource if this user may not replace a file or a folder of an older report; to
/// move a folder, one must be allowed to write into it.
void refuseReadOnly(const std::string& directory) {
    for (const std::string& name : reportParts()) {
        const std::string path = directory + "/" + name;
        if (fs::is_regular_file(path))
            static_cast<void>(outputTarget(path));
        if (!fs::is_directory(path))
            continue;
        std::string why = whyNotWritable(path);
        if (why.empty())
            why = whyNotReplaceable(path);
        if (!why.empty())
            throw Error(ErrorKind::kResource, path + ": cannot be replaced: " + why);
    }
}

/// Gives a file or a folder of a new report the attributes of the one that it replaces.
void keepAttributes(const fs::path& old, const fs::path& fresh) {
    if (const auto attributes = attributesOf(old); attributes && !attributes->giveTo(fresh))
        throw Error(ErrorKind::kResource, fresh.string() + ": cannot get the permissions of " +
                                              old.string() + ": " + std::strerror(errno) +
                                              "; choose another directory");
}

/// Gives all files of a new report, also those in its folders, the attributes of the old ones.
void keepAttributesOfFiles(const fs::path& old, const fs::path& fresh) {
    std::error_code failed;
    if (fs::is_directory(fresh)) {
        for (const auto& entry : fs::directory_iterator(fresh, failed))
            keepAttributesOfFiles(old / entry.path().filename(), entry.path());
    } else if (fs::is_regular_file(fresh) && fs::is_regular_file(old)) {
        keepAttributes(old, fresh);
    }
    if (failed)
        throw Error(ErrorKind::kResource,
                    fresh.string() + ": cannot be read: " + failed.message() +
                        "; make it readable (chmod u+rx) or choose another directory");
}

void moveFile(const std::string& from, const std::string& to) {
    std::error_code failed;
    fs::rename(from, to, failed);
    if (failed)
        throw Error(ErrorKind::kResource, from + ": cannot be moved to " + to + ": " +
                                              failed.message() + "; choose another directory");
}

/// Restores the older report after an interrupted swap, or after an undo that was interrupted. The
/// new files return to `partial`. Each move is the reverse of one of swapReport.
void undoSwap(const std::string& directory) {
    const std::string partial = directory + "/partial", old = partial + "/old";
    if (!fs::exists(old))
        return;
    const Json freshNames = readOwnJsonFile(partial + "/fresh.json");
    for (const std::string& name : reportParts()) {
        const std::string target = directory + "/" + name, fresh = partial + "/" + name;
        const bool wasThere = fs::exists(old + "/" + name);
        const bool isMoved =
            std::count(freshNames.begin(), freshNames.end(), Json(name)) > 0 && !fs::exists(fresh);
        if ((wasThere || isMoved) && fs::exists(target)) {
            std::error_code ignored; // a folder that was given the rights of an older one
            if (fs::is_directory(target))
                fs::permissions(target, fs::perms::owner_all, fs::perm_options::add, ignored);
            moveFile(target, fresh);
        }
        if (wasThere)
            moveFile(old + "/" + name, target);
    }
    fs::remove_all(old);
}

/// As createDirectory, of any length.
void makeDirectory(const std::string& path) {
    std::error_code failed;
    const fs::file_status there = fs::status(path, failed);
    if (failed == std::errc::too_many_symbolic_link_levels)
        throw Error(ErrorKind::kResource, path + ": is a loop of symbolic links; remove them");
    if (fs::exists(there) && !fs::is_directory(there))
        throw Error(ErrorKind::kResource, path + ": is not a directory; give one");
    if (!fs::exists(there) && fs::is_symlink(fs::symlink_status(path, failed)))
        throw Error(ErrorKind::kResource,
                    path + ": is a symbolic link that leads nowhere; create the directory that it "
                           "leads to, or remove the link");
    refuseFileAsFolder(path);
    fs::create_directories(path, failed);
    if (failed)
        throw Error(ErrorKind::kResource, path + ": cannot be created: " + failed.message() +
                                              "; choose another directory");
    if (const std::string why = whyNotWritable(path); !why.empty())
        throw Error(ErrorKind::kResource, path + ": cannot be written into: " + why);
    OutputFile(path + "/.shadowdag-probe"); // removed again, as it is not committed
}

/// Throws Error kUsage if the directory contains finished parts of an interrupted run, which one
/// that does not resume it would delete.
void refuseFinishedParts(const std::string& directory) {
    const Json journal = readOwnJsonFile(directory + "/partial/journal.json");
    const size_t count =
        journal.is_object() && journal.contains("parts") ? journal["parts"].size() : 0;
    if (count > 0)
        throw Error(ErrorKind::kUsage,
                    "-o '" + directory + "': contains " + std::to_string(count) +
                        (count == 1 ? " finished part" : " finished parts") +
                        " of an interrupted run, which this run would delete; add --resume to go "
                        "on after them, choose another directory, or delete " +
                        directory + "/partial");
}

/// Throws Error kUsage if the directory contains a report and a part is to be written, or the
/// reverse, because an interrupted swap of one for the other could not be undone.
void refuseOtherKind(const std::string& directory, bool isPart) {
    const char* other = isPart ? "results.json" : "part.json";
    if (fs::exists(directory + "/" + other))
        throw Error(ErrorKind::kUsage, "-o '" + directory + "': contains " +
                                           (isPart ? "a whole report" : "a part of a compare") +
                                           " (" + other + "); choose another directory for " +
                                           (isPart ? "a part" : "a report"));
}

} // namespace

bool holdsReport(const std::string& directory) {
    return !ownParts(directory).empty();
}

bool holdsTracerRows(const std::string& directory) {
    return holdsKeys(readOwnJsonFile(directory + "/tracers.json"), {"set_id", "runs"});
}

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
            break; // a dangling link exists, too
        fresh_.push_back(path.string());
    }
}

DirectoryGuard::~DirectoryGuard() {
    for (const std::string& path : fresh_)
        static_cast<void>(rmdir(path.c_str())); // it stays if it is not empty
}

ReportDirectory::ReportDirectory(const std::string& directory, bool resume, bool isPart)
    : partial_(directory + "/partial"), guard_(directory) {
    lock_.emplace(prepareDirectory(directory, resume, isPart));
}

ReportDirectory::~ReportDirectory() {
    try {
        std::error_code ignored;
        if (fs::exists(partial_ + "/old", ignored))
            return; // a swap that could not be undone keeps the older report
        const std::string path = partial_ + "/journal.json";
        const bool hasJournal = fs::exists(path, ignored); // --join has none
        const Json journal = readOwnJsonFile(path);
        const bool isEmpty =
            journal.is_object() && journal.contains("parts") && journal["parts"].empty();
        if (!hasJournal || isEmpty)
            fs::remove_all(partial_, ignored);
    } catch (const std::exception&) { // memory or files are short: it stays, as after a crash
    }
}

void createDirectory(const std::string& path) {
    // The longest path of a report, with its zero byte; the system refuses longer names.
    constexpr size_t kMostBytes = PATH_MAX - NAME_MAX - sizeof "/partial/done/images/";
    if (path.size() > kMostBytes)
        throw Error(ErrorKind::kResource, path + ": File name too long; choose a path of at most " +
                                              std::to_string(kMostBytes) +
                                              " bytes, so that the files in it have room");
    makeDirectory(path);
}

DirectoryLock prepareDirectory(const std::string& directory, bool resume, bool isPart) {
    createDirectory(directory);
    DirectoryLock lock("-o", directory);
    refuseForeignPartial(directory);
    undoSwap(directory);
    refuseForeignFiles(directory);
    refuseReadOnly(directory);
    refuseOtherKind(directory, isPart);
    if (!resume) {
        refuseFinishedParts(directory);
        std::error_code ignored;
        fs::remove_all(directory + "/partial", ignored);
    }
    makeDirectory(directory + "/partial/images");
    removeAbandonedFiles(directory + "/partial"); // of a killed run that is resumed
    return lock;
}

void swapReport(const std::string& directory) {
    const std::string partial = directory + "/partial", old = partial + "/old";
    refuseForeignFiles(directory); // which came during the run
    for (const std::string& name : reportParts())
        keepAttributesOfFiles(directory + "/" + name, partial + "/" + name);
    Json freshNames; // for undoSwap, before there is anything to undo
    for (const std::string& name : reportParts())
        if (fs::exists(partial + "/" + name))
            freshNames.push_back(name);
    writeWholeFile(partial + "/fresh.json", freshNames.dump());
    makeDirectory(old);
    auto held = delayRemovalOfUnfinishedFiles(); // and the end of the process
    try {
        for (const std::string& name : reportParts()) {
            const std::string target = directory + "/" + name, fresh = partial + "/" + name;
            if (fs::exists(target))
                moveFile(target, old + "/" + name);
            if (fs::exists(fresh))
                moveFile(fresh, target);
        }
        for (const std::string& name : reportParts()) // last, as they may forbid to move a folder
            if (fs::is_directory(directory + "/" + name) && fs::is_directory(old + "/" + name))
                keepAttributes(old + "/" + name, directory + "/" + name);
    } catch (...) {
        undoSwap(directory);
        throw;
    }
    const std::string done = partial + "/done";
    std::error_code ignored;
    fs::remove_all(done, ignored); // of a swap that was killed while it removed the older report
    moveFile(old, done);           // the swap is not undone from here on
    clearFinishedParts();
    held.unlock();
    fs::remove_all(partial, ignored);
}

} // namespace shadowdag
