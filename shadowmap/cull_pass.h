// SPDX-License-Identifier: Apache-2.0
// The culling passes: gather blocks, count and list what maps reach, count and
// list what they draw; scans lie between. See cull.h for what an item does.
#pragma once

#include "cuda/backend.h"
#include "shadowmap/cull.h"

namespace shadowdag {

namespace cpu {
void gatherBlocks(const GatherBlock& items);
void countReached(const CountReached& items);
void listReached(const ListReached& items);
void countDraws(const CountDraws& items);
void listDraws(const ListDraws& items);
void noteCullLengths(const NoteCullLengths& items);
} // namespace cpu

namespace cuda {
void gatherBlocks(const GatherBlock& items);
void countReached(const CountReached& items);
void listReached(const ListReached& items);
void countDraws(const CountDraws& items);
void listDraws(const ListDraws& items);
void noteCullLengths(const NoteCullLengths& items);
} // namespace cuda

/// Gathers the cells of every block. All views live on the backend.
inline void gatherBlocks(Backend backend, const GatherBlock& items) {
    SDAG_DISPATCH(backend, gatherBlocks, items);
}
/// Counts what every map reaches of every part of the hierarchy.
inline void countReached(Backend backend, const CountReached& items) {
    SDAG_DISPATCH(backend, countReached, items);
}
/// Writes what countReached counted.
inline void listReached(Backend backend, const ListReached& items) {
    SDAG_DISPATCH(backend, listReached, items);
}
/// Counts the draws of every map and part of the hierarchy.
inline void countDraws(Backend backend, const CountDraws& items) {
    SDAG_DISPATCH(backend, countDraws, items);
}
/// Writes the draws that countDraws counted.
inline void listDraws(Backend backend, const ListDraws& items) {
    SDAG_DISPATCH(backend, listDraws, items);
}
/// Copies the lengths of what was reached and of the draws.
inline void noteCullLengths(Backend backend, const NoteCullLengths& items) {
    SDAG_DISPATCH(backend, noteCullLengths, items);
}

} // namespace shadowdag
