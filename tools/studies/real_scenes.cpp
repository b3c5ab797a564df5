// SPDX-License-Identifier: Apache-2.0
// The tables of real scenes and what their cells are held to.
#include "tools/studies/real_scenes.h"

#include "cuda/error.h"

#include <algorithm>

namespace shadowdag {

const std::string& realSettings() {
    static const std::string settings = "resolution=2048 pool=256M";
    return settings;
}

const std::vector<RealScene>& realScenes() {
    static const std::vector<RealScene> scenes = {
        {"crytek_sponza_half", "c246f6bf00e69b3afd743c4ac994413c", "auto",
         "An atrium of stone and cloth, positions in steps up to 8 mm, four lamps and a sun."},
        {"kaykit_dungeon", "d95ed12c64a1b88938b58c51f1e4d632", "auto",
         "A dungeon of repeated parts, mirrored and unevenly scaled, 534 lights."},
        {"kaykit_dungeon_4", "980dadb04def9fc010c63e30a6b53a75", "auto",
         "A ninth of that dungeon."},
        {"lost_empire_torches", "b575e30dcd82714cb2cb72815f2040b9", "auto",
         "A ruin of cubes with 422 torches a hand's breadth from walls."},
        // Where a camera is placed by itself, behind a wall, no light reaches.
        {"lq_e0m2", "615e6f7ce1fb89a94ef2b46810178692", "4.5,2.2,10,2,0.5,-4",
         "A game map, 146 lights: from one room through a door into the next."},
        {"lq_e1m1", "662d4d3e1076d929daa9e0fd3aa20f1f", "auto",
         "A game map, 251 points and 45 spots."},
        {"lq_e1m2", "2c6d1235115d1bfdec30ee2baca90739", "auto", "A game map, 133 lights."},
        {"lq_e1m5", "730a7d1b9fa1966f7aff929e4fb0e566", "auto",
         "A game map, 472 points and 17 spots."},
        {"lq_e2m3", "8cff229b0a05bb2e47d256049a50f145", "auto",
         "A game map, 451 lights, of which many overlap."},
        {"lq_start_e0", "66b78b3a63377088b61fafabd0cc8080", "auto",
         "A game map, 113 points and 42 spots."},
        {"lqdm1", "3d6c5ef30652ae0cb44e06c0dd6f4dc8", "auto", "A small game map, 32 lights."},
        {"lqdm3", "65f71a745e38ef19ac19ced66ceb3edc", "auto",
         "A game map, 25 points and 26 spots."},
    };
    return scenes;
}

const std::vector<NamedErrors>& namedErrors() {
    static const std::vector<NamedErrors> errors = {
        {"lqdm1", MatrixMethod::kMaps, 42, "light-in-plane",
         "A light lies exactly in the plane of a face that stands diagonally: rounding alone says "
         "that some of its samples face the light. The truth asks above the plane and is lit; half "
         "of a map's taps ask behind it, within the solid. At n.l of about 1e-8 no picture shows "
         "it."},
        {"crytek_sponza_half", MatrixMethod::kDag, 1, "unsettled-voxel",
         "One pair, on a wall: a voxel stops its ray whose triangles none of the shifts meets, "
         "neither the 32 nor those aimed at their corners. Which triangle it is was not looked "
         "at."},
        {"crytek_sponza_half", MatrixMethod::kHybrid, 1, "unsettled-voxel", "The same pair."},
        {"lq_e0m2", MatrixMethod::kDag, 86, "surface-behind",
         "A corner: the wall that stops the ray stands behind the receiver, about a voxel away, "
         "and its voxel reaches past the ray's start. Shifts go across the ray, so none meets what "
         "lies behind it. So it is with each of the 8 pairs that were looked at."},
        {"lq_e0m2", MatrixMethod::kHybrid, 9, "surface-behind",
         "Those of the same pairs whose maps are traced."},
        {"kaykit_dungeon", MatrixMethod::kDag, 15, "surface-behind",
         "As in lq_e0m2 of 7 of the 8 pairs that were looked at. The ray of the eighth passes a "
         "facet in its voxel by a third of one; why no shift meets it was not looked at."},
    };
    return errors;
}

Json realBounds(const std::string& scene, MatrixMethod method, const CellCounts* known) {
    Json bounds = Json::object();
    uint64_t namedCount = 0;
    for (const NamedErrors& named : namedErrors())
        if (named.scene == scene && named.method == method)
            namedCount += named.count;
    bounds["unnamed_count"] = namedCount == 0 ? 0 : namedCount + namedCount / 20 + 3;
    if (known) {
        const CellCounts bound = boundOf(*known);
        for (size_t m = 0; m < bound.size(); ++m)
            bounds[kCellMeasureNames[m]] = bound[m];
    }
    if (method == MatrixMethod::kDagExact) {
        // The truth, triangle by triangle, in double where Embree rounds: a pair whose ray grazes
        // an edge may differ, and counts as explained. What is known of that has no slack.
        for (const char* name :
             {"false_shadow_count", "false_light_count", "mean_error_millionths", "flicker_count"})
            bounds[name] = 0;
        bounds["unexplained_count"] = 0;
        if (known)
            for (size_t m = 0; m < known->size(); ++m)
                bounds[kCellMeasureNames[m]] = (*known)[m];
    }
    if (method == MatrixMethod::kDag || method == MatrixMethod::kDagExact)
        bounds["acne_count"] = 0;
    return bounds;
}

bool showsShadowEdge(const Json& cell) {
    const uint64_t dark = cell["occluded_count"].get<uint64_t>();
    return dark > 0 && dark < cell["pair_count"].get<uint64_t>();
}

Json realBroken(const Json& cell, const Json& bounds) {
    Json broken = Json::array();
    for (const auto& [name, bound] : bounds.items())
        if (cell[name].get<uint64_t>() > bound.get<uint64_t>())
            broken.push_back(name);
    if (cell.value("known", "") == "yes" && !showsShadowEdge(cell))
        broken.push_back("occluded_count");
    return broken;
}

std::vector<std::string> realBrokenLines(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& cell : results["cells"])
        for (const Json& measure : cell["broken"]) {
            const std::string name = measure.get<std::string>();
            std::string line = cell["scene"].get<std::string>() + " by " +
                               cell["method"].get<std::string>() + ": ";
            if (name == "unknown")
                line += "no bound is known; run tools/report/failure_known.py";
            else if (name == "occluded_count")
                line += "shows no shadow edge, occluded_count is " + cell[name].dump() + " of " +
                        cell["pair_count"].dump() +
                        " pairs; give the scene a view that sees light "
                        "and shadow";
            else
                line +=
                    name + " is " + cell[name].dump() + ", bound " + cell["bounds"][name].dump();
            if (name == "unnamed_count" && !cell["unnamed"].empty()) {
                const Json& first = cell["unnamed"][0];
                line += "; the first: a " + first["error"].get<std::string>() + " in frame " +
                        first["frame"].dump() + " at pixel " + first["pixel"][0].dump() + "," +
                        first["pixel"][1].dump() + " of light " + first["light"].dump();
            }
            lines.push_back(line);
        }
    return lines;
}

} // namespace shadowdag
