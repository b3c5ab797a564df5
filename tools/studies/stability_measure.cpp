// SPDX-License-Identifier: Apache-2.0
// The groups, and what runs them.
#include "tools/studies/stability.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/fail_scenes.h"
#include "tools/settings/parse.h"

#include <algorithm>

namespace shadowdag {

namespace {

constexpr StabilityPart kTime = StabilityPart::kTime, kPerturbation = StabilityPart::kPerturbation,
                        kNumeric = StabilityPart::kNumeric,
                        kResolution = StabilityPart::kResolution;

} // namespace

const std::vector<StabilityGroup>& stabilityGroups() {
    static const std::vector<StabilityGroup> groups = {
        {"time-posts", kTime, "fail-popping",
         "Posts between nine lights; the camera sways, so that requests waver about steps of "
         "resolution and about the hybrid's threshold.",
         56, "camera path", 1e30, "threshold=192"},
        {"time-plates", kTime, "fail-method-switch",
         "Low plates between nine lights; as before, with contact shadows that rays and maps lose "
         "unlike each other.",
         56, "camera path", 1e30, "threshold=120"},
        {"time-lights", kTime, "fail-popping",
         "The posts again, the camera still, the lights drifting, so that requests change with "
         "what they shine on.",
         56, "moving lights", 1e30, "threshold=120"},
        {"perturbation-tiles", kPerturbation, "fail-self-shadow",
         "Tiles leaning at all angles over a floor: outlines along no axis.", 96, "", 1e30,
         "threshold=200 maps_per_light=4"},
        {"perturbation-posts", kPerturbation, "fail-popping",
         "Upright posts on a floor, nine lights: outlines along the axes, at places of their own.",
         56, "", 1e30, "threshold=384"},
        {"perturbation-cubes", kPerturbation, "fail-axis-aligned",
         "Cubes whose faces lie in faces of voxels, lights in planes of texels: ties everywhere.",
         32, ", aligned", 1e30, "threshold=340"},
        {"numeric-rays", kNumeric, "",
         "Lines in all 26 directions past the corners, edges and faces of a voxel, in eighths of "
         "the "
         "margin that the slab test grows boxes by.",
         0, "rays"},
        {"numeric-faces", kNumeric, "",
         "Texels along the edges and corners of a cube map's faces and beyond them.", 0, "faces"},
        {"resolution-cubes", kResolution, "fail-silhouette",
         "Cubes of 0.5 m to 8 mm over a floor. A cube smaller than a voxel is wrong by the voxel "
         "squared, "
         "so rays are fitted from voxels of 20 mm on.",
         28, "outlines", 0.02},
        {"resolution-posts", kResolution, "fail-popping", "Posts on a floor, nine lights.", 56,
         "outlines"},
        {"resolution-wires", kResolution, "fail-wires",
         "A grate of wires of 12 mm: no outline is resolved until voxels are thinner than they "
         "are.",
         160, "thin", 0.022},
        {"resolution-atrium", kResolution, "builtin:atrium",
         "The atrium: walls, columns and plants, 65 lights.", 4000, "mixed"},
        {"resolution-necropolis", kResolution, "builtin:necropolis",
         "Leaves and rails: the finer one looks, the longer the outlines.", 4000, "mixed"},
    };
    return groups;
}

std::vector<std::string> stabilitySettings(const StabilityGroup& group,
                                           const StabilityRequest& request) {
    const double threshold = cellSetup({group.settings}).hybridTexels;
    return {"resolution=512", group.settings,
            "threshold=" + numberText(threshold * request.width / kStabilityWidth)};
}

Scene stabilityScene(const StabilityGroup& group) {
    if (group.scene.starts_with("builtin:"))
        return loadScene(group.scene);
    for (FailScene& scene : failScenes())
        if (scene.name == group.scene) {
            if (group.kind == "moving lights") {
                scene.eyeSway = glm::dvec3(0.0);
                for (size_t i = 0; i < scene.lights.size(); ++i)
                    scene.lights[i].velocity = {i % 2 ? 0.5 : -0.5, 0.0, i % 3 ? 0.375 : -0.375};
            }
            return makeFailScene(scene);
        }
    throw Error(ErrorKind::kUsage, "group " + group.name + " names the scene '" + group.scene +
                                       "', which there is not");
}

std::vector<const StabilityGroup*> stabilityGroupsNamed(const std::vector<std::string>& names) {
    std::vector<const StabilityGroup*> chosen;
    for (const StabilityGroup& group : stabilityGroups())
        if (names.empty())
            chosen.push_back(&group);
    for (const std::string& name : names) {
        const size_t before = chosen.size();
        for (const StabilityGroup& group : stabilityGroups())
            if ((group.name == name || kStabilityPartNames[size_t(group.part)] == name) &&
                std::find(chosen.begin(), chosen.end(), &group) == chosen.end())
                chosen.push_back(&group);
        if (chosen.size() == before) {
            std::string all = "time, perturbation, numeric, resolution";
            for (const StabilityGroup& group : stabilityGroups())
                all += ", " + group.name;
            throw Error(ErrorKind::kUsage,
                        "--only '" + name + "': must be one of " + all + ", and none named twice");
        }
    }
    return chosen;
}

Json measureStability(const StabilityRequest& request) {
    const std::vector<const StabilityGroup*> chosen = stabilityGroupsNamed(request.names);
    Json results = Json::object();
    for (const char* key : {"time", "perturbation", "numeric", "resolution", "rates", "checks"})
        results[key] = Json::array();
    size_t done = 0;
    for (const StabilityGroup* group : chosen) {
        constexpr void (*kMeasure[kStabilityPartCount])(const StabilityGroup&,
                                                        const StabilityRequest&, Json&) = {
            measureTime, measurePerturbation, measureNumeric, measureResolution};
        kMeasure[size_t(group->part)](*group, request, results);
        if (request.progress)
            request.progress(double(++done) / double(chosen.size()));
    }
    return results;
}

std::vector<std::string> unstableLines(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& check : results["checks"])
        if (!check["holds"].get<bool>())
            lines.push_back(check["group"].get<std::string>() + ", " +
                            check["case"].get<std::string>() + ", by " +
                            check["method"].get<std::string>() + ": " +
                            check["measure"].get<std::string>() + " is " + check["value"].dump() +
                            ", band " + check["low"].dump() + " to " + check["high"].dump() + " (" +
                            check["band"].get<std::string>() + ")");
    return lines;
}

} // namespace shadowdag
