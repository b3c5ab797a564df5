// SPDX-License-Identifier: Apache-2.0
// Written by tools/failure_known.py out of a run's real.json; not to be edited.
// Columns: scene, method, true; false shadow, false light, unexplained, acne, contact, missing
// taps, mean error in millionths, flicker.
#include "tools/real_scenes.h"

namespace shadowdag {

// clang-format off
const std::vector<KnownCell>& knownRealCells() {
    using enum MatrixMethod;
    static const std::vector<KnownCell> cells = {
        {"crytek_sponza_half", kMaps, true, {{699, 1098, 11, 0, 29, 0, 19549, 32}}},
        {"crytek_sponza_half", kDag, true, {{2653, 561, 8, 0, 29, 0, 13391, 0}}},
        {"crytek_sponza_half", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"crytek_sponza_half", kHybrid, true, {{727, 1000, 12, 0, 28, 0, 18766, 29}}},
        {"kaykit_dungeon_4", kMaps, true, {{893, 510, 4, 0, 1, 0, 8150, 76}}},
        {"kaykit_dungeon_4", kDag, true, {{6417, 263, 0, 0, 39, 0, 11639, 0}}},
        {"kaykit_dungeon_4", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"kaykit_dungeon_4", kHybrid, true, {{893, 510, 4, 0, 1, 0, 8150, 76}}},
        {"lost_empire_torches", kMaps, true, {{8291, 9063, 238, 0, 865, 0, 19875, 261}}},
        {"lost_empire_torches", kDag, true, {{49899, 742, 0, 0, 117, 0, 25796, 0}}},
        {"lost_empire_torches", kDagExact, true, {{0, 1, 0, 0, 0, 0, 1, 0}}},
        {"lost_empire_torches", kHybrid, true, {{17631, 3764, 24, 0, 190, 0, 16585, 412}}},
        {"lq_e0m2", kMaps, true, {{0, 0, 0, 0, 0, 0, 4, 0}}},
        {"lq_e0m2", kDag, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e0m2", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e0m2", kHybrid, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m1", kMaps, true, {{773, 408, 0, 0, 0, 0, 7275, 44}}},
        {"lq_e1m1", kDag, true, {{18282, 66, 0, 0, 4, 0, 32331, 0}}},
        {"lq_e1m1", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m1", kHybrid, true, {{4110, 224, 0, 0, 0, 0, 11454, 68}}},
        {"lq_e1m2", kMaps, true, {{694, 68, 0, 0, 0, 0, 3929, 15}}},
        {"lq_e1m2", kDag, true, {{9942, 127, 0, 0, 11, 0, 27662, 0}}},
        {"lq_e1m2", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m2", kHybrid, true, {{783, 69, 0, 0, 0, 0, 3804, 2}}},
        {"lq_e1m5", kMaps, true, {{146, 119, 0, 0, 5, 0, 2675, 1}}},
        {"lq_e1m5", kDag, true, {{1448, 32, 0, 0, 2, 0, 4184, 0}}},
        {"lq_e1m5", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m5", kHybrid, true, {{211, 87, 0, 0, 2, 0, 2001, 1}}},
        {"lq_e2m3", kMaps, true, {{3188, 1717, 0, 0, 1, 0, 5928, 76}}},
        {"lq_e2m3", kDag, true, {{68482, 2896, 0, 0, 1, 0, 36055, 0}}},
        {"lq_e2m3", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e2m3", kHybrid, true, {{3344, 1704, 0, 0, 1, 0, 5906, 82}}},
        {"lq_start_e0", kMaps, true, {{654, 824, 0, 0, 19, 0, 5086, 41}}},
        {"lq_start_e0", kDag, true, {{12147, 288, 0, 0, 65, 0, 11746, 0}}},
        {"lq_start_e0", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_start_e0", kHybrid, true, {{645, 852, 0, 0, 16, 0, 4253, 28}}},
        {"lqdm1", kMaps, true, {{452, 212, 138, 0, 0, 0, 3108, 3}}},
        {"lqdm1", kDag, true, {{4675, 39, 0, 0, 0, 0, 10106, 0}}},
        {"lqdm1", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lqdm1", kHybrid, true, {{398, 191, 0, 0, 0, 0, 2919, 3}}},
        {"lqdm3", kMaps, true, {{270, 124, 0, 0, 0, 0, 2508, 3}}},
        {"lqdm3", kDag, true, {{4645, 7, 0, 0, 6, 0, 11582, 0}}},
        {"lqdm3", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lqdm3", kHybrid, true, {{1280, 68, 0, 0, 0, 0, 4187, 4}}},
    };
    return cells;
}
// clang-format on

} // namespace shadowdag
