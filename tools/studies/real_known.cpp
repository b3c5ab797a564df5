// SPDX-License-Identifier: Apache-2.0
// Written by tools/report/failure_known.py out of a run's real.json; not to be edited.
// Columns: scene, method, true; false shadow, false light, unexplained, acne, contact, missing
// taps, mean error in millionths, flicker.
#include "tools/studies/real_scenes.h"

namespace shadowdag {

// clang-format off
const std::vector<KnownCell>& knownRealCells() {
    using enum MatrixMethod;
    static const std::vector<KnownCell> cells = {
        {"crytek_sponza_half", kMaps, true, {{946, 1030, 29, 0, 35, 0, 12098, 48}}},
        {"crytek_sponza_half", kDag, true, {{2653, 561, 8, 0, 29, 0, 13391, 0}}},
        {"crytek_sponza_half", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"crytek_sponza_half", kHybrid, true, {{981, 886, 30, 0, 32, 0, 11497, 48}}},
        {"kaykit_dungeon", kMaps, true, {{2416, 1893, 47, 0, 1, 0, 7946, 150}}},
        {"kaykit_dungeon", kDag, true, {{32212, 6570, 20, 0, 1546, 0, 43561, 0}}},
        {"kaykit_dungeon", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"kaykit_dungeon", kHybrid, true, {{2416, 1893, 47, 0, 1, 0, 7946, 150}}},
        {"kaykit_dungeon_4", kMaps, true, {{1084, 708, 41, 0, 30, 0, 5149, 95}}},
        {"kaykit_dungeon_4", kDag, true, {{6417, 263, 0, 0, 39, 0, 11639, 0}}},
        {"kaykit_dungeon_4", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"kaykit_dungeon_4", kHybrid, true, {{1084, 708, 41, 0, 30, 0, 5149, 95}}},
        {"lost_empire_torches", kMaps, true, {{9511, 9711, 383, 0, 927, 0, 13869, 393}}},
        {"lost_empire_torches", kDag, true, {{49899, 742, 0, 0, 117, 0, 25796, 0}}},
        {"lost_empire_torches", kDagExact, true, {{0, 1, 0, 0, 0, 0, 1, 0}}},
        {"lost_empire_torches", kHybrid, true, {{22162, 3590, 17, 0, 192, 0, 14755, 479}}},
        {"lq_e0m2", kMaps, true, {{238, 300, 0, 0, 3, 0, 1637, 16}}},
        {"lq_e0m2", kDag, true, {{24659, 35, 96, 0, 5, 0, 54114, 0}}},
        {"lq_e0m2", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e0m2", kHybrid, true, {{630, 226, 19, 0, 2, 0, 2285, 16}}},
        {"lq_e1m1", kMaps, true, {{848, 485, 0, 0, 1, 0, 4498, 53}}},
        {"lq_e1m1", kDag, true, {{18282, 66, 0, 0, 4, 0, 32331, 0}}},
        {"lq_e1m1", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m1", kHybrid, true, {{6076, 225, 0, 0, 0, 0, 12461, 72}}},
        {"lq_e1m2", kMaps, true, {{732, 57, 0, 0, 0, 0, 2541, 15}}},
        {"lq_e1m2", kDag, true, {{9942, 127, 0, 0, 11, 0, 27662, 0}}},
        {"lq_e1m2", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m2", kHybrid, true, {{804, 58, 0, 0, 0, 0, 2659, 2}}},
        {"lq_e1m5", kMaps, true, {{188, 211, 0, 0, 8, 0, 1767, 0}}},
        {"lq_e1m5", kDag, true, {{1448, 32, 0, 0, 2, 0, 4184, 0}}},
        {"lq_e1m5", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e1m5", kHybrid, true, {{328, 119, 0, 0, 2, 0, 1597, 0}}},
        {"lq_e2m3", kMaps, true, {{4266, 2925, 2, 0, 6, 0, 5222, 244}}},
        {"lq_e2m3", kDag, true, {{68482, 2896, 0, 0, 1, 0, 36055, 0}}},
        {"lq_e2m3", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_e2m3", kHybrid, true, {{5497, 2851, 2, 0, 6, 0, 5725, 358}}},
        {"lq_start_e0", kMaps, true, {{793, 855, 0, 0, 19, 0, 2958, 20}}},
        {"lq_start_e0", kDag, true, {{12147, 288, 0, 0, 65, 0, 11746, 0}}},
        {"lq_start_e0", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lq_start_e0", kHybrid, true, {{758, 864, 0, 0, 16, 0, 2558, 3}}},
        {"lqdm1", kMaps, true, {{438, 279, 140, 0, 0, 0, 2071, 1}}},
        {"lqdm1", kDag, true, {{4675, 39, 0, 0, 0, 0, 10106, 0}}},
        {"lqdm1", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lqdm1", kHybrid, true, {{400, 252, 0, 0, 0, 0, 1920, 1}}},
        {"lqdm3", kMaps, true, {{292, 100, 0, 0, 0, 0, 1550, 2}}},
        {"lqdm3", kDag, true, {{4645, 7, 0, 0, 6, 0, 11582, 0}}},
        {"lqdm3", kDagExact, true, {{0, 0, 0, 0, 0, 0, 0, 0}}},
        {"lqdm3", kHybrid, true, {{1307, 69, 0, 0, 0, 0, 3638, 5}}},
    };
    return cells;
}
// clang-format on

} // namespace shadowdag
