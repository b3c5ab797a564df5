// SPDX-License-Identifier: Apache-2.0
// Runs the threads of a kernel on the host: blocks in a shuffled order on several threads, the
// lanes of a block in a shuffled order, one at a time, each until it waits for others of its warp
// or block. A lane that waits keeps its stack (a fiber); kernels in which none waits use one stack
// a thread. Shuffles follow a seed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace shadowdag::cuda_host {

constexpr unsigned kWarpLanes = 32;

struct Index3 {
    unsigned x = 0, y = 0, z = 0;
};

} // namespace shadowdag::cuda_host

/// Where the lane is that runs on this thread.
inline thread_local constinit shadowdag::cuda_host::Index3 threadIdx, blockIdx, blockDim, gridDim;

namespace shadowdag::cuda_host {

/// Runs `lane` for every thread of every block, and returns when all have left. Aborts, naming the
/// kernel and the lane, for waits that can never end.
/// @param kernel its name in messages
void runGrid(const std::string& kernel, Index3 blocks, Index3 threads,
             const std::function<void()>& lane);

/// Returns whether the caller is a lane of a kernel.
bool isLane();
/// Returns "kernel NAME, block (x, y, z), thread (x, y, z)", for the caller's lane.
std::string laneName();

/// What lanes wait for.
enum class Meeting { kSyncWarp, kShuffle, kBallot, kSyncBlock };

/// Waits until all lanes that `mask` names have called it with the same meeting and mask, and
/// returns their values, by lane; valid until the caller's next call. kSyncBlock: waits for all
/// threads of the block that have not left. Aborts if the mask does not name the caller, or names a
/// lane that has left or does not exist.
const uint64_t* meet(Meeting meeting, uint32_t mask, uint64_t value);

/// Aborts with the lane and the place of the failed assertion.
[[noreturn]] void trap(const char* file, int line);

/// Prints "cuda host: " and the message, and aborts.
[[noreturn]] void die(const std::string& message);

/// Returns the seed of all shuffles: SDAG_CUDA_HOST_SEED, else 1. Printed when it is first used.
uint64_t seed();

/// Returns a well mixed number for a number (SplitMix64 of Steele, Lea, Flood, Fast Splittable
/// Pseudorandom Number Generators, OOPSLA 2014).
constexpr uint64_t mixed(uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

} // namespace shadowdag::cuda_host
