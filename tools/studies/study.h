// SPDX-License-Identifier: Apache-2.0
// A study: rows that are measured part by part, and their verdicts. One runner (study_run.cpp) runs
// all kinds; a kind is a class here and a schema in docs/studies.md.
#pragma once

#include "cuda/backend.h"
#include "tools/settings/json.h"
#include "tools/studies/study_file.h"

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace shadowdag {

class Console;

/// The request: rows, scenes, settings of the run, and the place for pictures.
struct StudyRequest {
    Backend backend = Backend::kCpu;
    std::vector<std::string> names;  ///< of rows; empty: all
    std::vector<std::string> scenes; ///< instead of the rows' own
    std::string cacheDirectory;      ///< of voxels, as VoxelSource takes it
    std::string pictureDirectory;    ///< "" for none; else files are written there
    std::function<void(double)> progress =
        {}; ///< receives the finished share of a part; may be empty
};

/// A study that was read for a request. Results depend only on file and request, except times.
class Study {
public:
    virtual ~Study() = default;

    /// Returns the names of the parts in the order of measurement. Invalid requests were refused
    /// when the study was made.
    virtual std::vector<std::string> parts() const = 0;
    /// Returns the scenes that the parts are measured on, as loadScene takes them. Results depend
    /// on their files, so that a change of one ends what --resume can take up.
    virtual std::vector<std::string> scenes() const = 0;
    /// Measures a part. @param part its index
    virtual Json measure(size_t part, const StudyRequest& request) = 0;
    /// Returns the results of all parts, in order: by default their lists joined under the same
    /// keys.
    virtual Json join(std::vector<Json> parts) const;
    /// Returns one line per result that exceeds its bounds.
    virtual std::vector<std::string> brokenLines(const Json& results) const = 0;
    /// Returns what was judged, as in "12 checks".
    virtual std::string judged(const Json& results) const = 0;
    /// Prints what the results contain besides exceeded bounds.
    virtual void print(const Json&, const Console&) const {}
    /// Returns the table of the results.
    virtual std::string csv(const Json& results) const = 0;
    /// Returns whether the page has charts, which --no-charts leaves out.
    virtual bool drawsCharts() const { return false; }
    /// Returns the counts for --json.
    virtual Json counts(const Json& results) const = 0;
    /// Returns whether a run whose results exceed bounds ends in NotHeld.
    virtual bool mustHold() const { return true; }
    /// Returns whether results contain times.
    virtual bool takesTimes() const { return false; }
    /// Returns whether voxels are read from and written to the request's cacheDirectory.
    virtual bool usesCache() const { return false; }
    /// Returns whether a scene without lights is an error.
    virtual bool needsLights() const { return true; }
    /// Returns what the rows need that OpenGL does not support, "" for nothing.
    virtual std::string needsBeyondGl() const { return ""; }
};

/// Reads a study for a request. Throws Error kInput for a file that is not a study, naming file and
/// row, kUsage for names and scenes that it does not have.
std::unique_ptr<Study> makeStudy(const StudyFile& file, const StudyRequest& request,
                                 const Console& console);

/// Returns the name of a scene in results: its file's name without directories and extension.
std::string sceneStem(const std::string& scene);
/// Returns the name of a row that is measured on a user's scene.
std::string rowNameOn(const std::string& row, const std::string& scene);

/// Measures all parts one after the other, without a report.
Json measureAll(Study& study, const StudyRequest& request);

/// Thrown after all work if results exceed their bounds; the message names them. Not an Error: the
/// request was valid and nothing is missing.
struct NotHeld : std::runtime_error {
    using std::runtime_error::runtime_error;
    static constexpr int kExitStatus = 5;
};

/// The arguments of `study`.
struct StudyCommand {
    std::string output;
    bool resume = false, noCharts = false;
};

/// Measures the parts that are not in the journal of the directory, writes the report and prints
/// the exceeded bounds. Throws NotHeld if there are any, after the report is written; Error for
/// scenes that cannot be measured, before an older unfinished study is deleted.
void runStudy(const StudyFile& file, Study& study, const StudyRequest& request,
              const StudyCommand& command, const Console& console);

} // namespace shadowdag
