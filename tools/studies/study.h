// SPDX-License-Identifier: Apache-2.0
// A study: rows that are measured part by part, and what is said of them. One runner
// (study_run.cpp) serves all kinds; a kind is a class here and a schema in docs/studies.md.
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

/// What to measure, on what, and where pictures go.
struct StudyRequest {
    Backend backend = Backend::kCpu;
    std::vector<std::string> names;  ///< of rows; empty: all
    std::vector<std::string> scenes; ///< in place of the rows' own
    std::string cacheDirectory;      ///< of voxels, as VoxelSource takes it
    std::string pictureDirectory;    ///< "" for none; else files are written there
    std::function<void(double)> progress =
        {}; ///< told the share that is done of a part; may be empty
};

/// A study that was read and asked for. Results depend on nothing but file and request; times are
/// the exception.
class Study {
public:
    virtual ~Study() = default;

    /// Returns the names of the parts in the order in which they are measured. What is refused
    /// beforehand was refused when the study was made.
    virtual std::vector<std::string> parts() const = 0;
    /// Measures a part. @param part its index
    virtual Json measure(size_t part, const StudyRequest& request) = 0;
    /// Returns the results of all parts, in order: where nothing else is said, their lists joined
    /// under the same keys.
    virtual Json join(std::vector<Json> parts) const;
    /// Returns one line a thing that does not hold.
    virtual std::vector<std::string> brokenLines(const Json& results) const = 0;
    /// Returns what was judged, as in "12 checks".
    virtual std::string judged(const Json& results) const = 0;
    /// Writes for people what the results say beside broken lines.
    virtual void print(const Json&, const Console&) const {}
    /// Returns the table of the results.
    virtual std::string csv(const Json& results) const = 0;
    /// Returns whether the page has charts, which --no-charts leaves out.
    virtual bool drawsCharts() const { return false; }
    /// Returns the counts for --json.
    virtual Json counts(const Json& results) const = 0;
    /// Returns whether a run whose results do not hold ends in NotHeld.
    virtual bool mustHold() const { return true; }
    /// Returns what the rows need that OpenGL does not follow, "" for nothing.
    virtual std::string needsBeyondGl() const { return ""; }
};

/// Reads a study for a request. Throws Error kInput for a file that is no study, naming file and
/// row, kUsage for names and scenes that cannot be asked of it.
std::unique_ptr<Study> makeStudy(const StudyFile& file, const StudyRequest& request,
                                 const Console& console);

/// Returns what a scene is called in results: its file's name without directories and extension.
std::string sceneStem(const std::string& scene);
/// Returns what a row is called that is measured on a scene of the user's.
std::string rowNameOn(const std::string& row, const std::string& scene);

/// Measures all parts one after the other, without a report.
Json measureAll(Study& study, const StudyRequest& request);

/// Thrown when all work is done and its results do not hold; the message names what. Not an Error:
/// nothing was asked wrongly and nothing is missing.
struct NotHeld : std::runtime_error {
    using std::runtime_error::runtime_error;
    static constexpr int kExitStatus = 5;
};

/// What `study` was asked for.
struct StudyCommand {
    std::string output;
    bool resume = false, noCharts = false;
};

/// Measures what is not in the journal of the directory, writes the report and says what does not
/// hold. Throws NotHeld when anything does not, the report standing.
void runStudy(const StudyFile& file, Study& study, const StudyRequest& request,
              const StudyCommand& command, const Console& console);

} // namespace shadowdag
