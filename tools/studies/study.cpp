// SPDX-License-Identifier: Apache-2.0
// The kinds of studies.
#include "tools/studies/study.h"

#include "cuda/error.h"
#include "tools/studies/ablation.h"
#include "tools/studies/adjudication.h"
#include "tools/studies/failures.h"
#include "tools/studies/mutants.h"
#include "tools/studies/real_scenes.h"
#include "tools/studies/scale.h"
#include "tools/studies/stability.h"
#include "tools/workspace/study_kinds.h"

#include <filesystem>
#include <iterator>
#include <set>

namespace shadowdag {

namespace {

using Make = std::unique_ptr<Study> (*)(const StudyFile&, const StudyRequest&, const Console&);

/// In the order of kStudyKinds.
constexpr Make kKinds[] = {makeAblationStudy, makeAdjudicationStudy, makeFailureStudy,
                           makeMutantStudy,   makeRealStudy,         makeScaleStudy,
                           makeStabilityStudy};
static_assert(std::size(kKinds) == std::size(kStudyKinds));

} // namespace

std::unique_ptr<Study> makeStudy(const StudyFile& file, const StudyRequest& request,
                                 const Console& console) {
    StudyReader reader(file.json, file.path);
    const size_t kind = reader.choice("kind", kStudyKinds);
    std::unique_ptr<Study> study = kKinds[kind](file, request, console);
    if (request.backend == Backend::kGl && !study->needsBeyondGl().empty())
        throw Error(ErrorKind::kUsage,
                    "--backend gl: study " + file.name + " needs " + study->needsBeyondGl() +
                        ", which it does not support; use --backend cpu or cuda");
    // Parts are found again by their names: of two equal ones, the second would not be measured.
    std::set<std::string> names;
    for (const std::string& part : study->parts())
        if (!names.insert(part).second)
            throw Error(ErrorKind::kUsage,
                        "two of the scenes given would both be '" + part +
                            "' in the report; rename one or measure them separately");
    return study;
}

std::string sceneStem(const std::string& scene) {
    return std::filesystem::path(scene).stem().string();
}

std::string rowNameOn(const std::string& row, const std::string& scene) {
    const std::string stem = sceneStem(scene);
    return row + "-" + stem.substr(stem.find(':') + 1);
}

} // namespace shadowdag
