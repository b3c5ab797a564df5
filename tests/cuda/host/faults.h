// SPDX-License-Identifier: Apache-2.0
// Faults on request: calls of the CUDA runtime that fail, for tests, and mutants of the device
// layer, one a process, which the tests must notice. A mutant changes what a call of the runtime
// does where one function of ours makes it, or what a function of lanes returns: the program under
// test contains none.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace shadowdag::cuda_host {

/// What a mutant does to a call.
enum class Fault : uint8_t {
    kNone,
    kLeftOut,     ///< it reports success and does nothing
    kOtherStream, ///< it is queued on another stream, which no one waits for
    kShort,       ///< the last four bytes, or the last block, are left out
    kShifted,     ///< it begins four bytes later
    kEarly,       ///< it is done at once, before what is queued
};

/// All mutants: X(enumerator, name, what is wrong, function of the runtime, text of our function
/// that calls it or of the kernel that it starts, what happens). The order is that of the table.
#define SDAG_CUDA_HOST_MUTANTS(X)                                                                  \
    X(kUploadLost, "upload-lost", "small uploads are left out", "cudaMemcpyAsync",                 \
      "Staging::upload", kLeftOut)                                                                 \
    X(kUploadShort, "upload-short", "small uploads lack their last four bytes", "cudaMemcpyAsync", \
      "Staging::upload", kShort)                                                                   \
    X(kUploadShifted, "upload-shifted", "small uploads begin four bytes too late",                 \
      "cudaMemcpyAsync", "Staging::upload", kShifted)                                              \
    X(kUploadStream, "upload-stream", "small uploads are on another stream", "cudaMemcpyAsync",    \
      "Staging::upload", kOtherStream)                                                             \
    X(kStagingUnawaited, "staging-unawaited", "staging memory is reused before it was copied",     \
      "cudaEventSynchronize", "Staging::upload", kLeftOut)                                         \
    X(kStagingUnmarked, "staging-unmarked", "copies from staging memory are not marked",           \
      "cudaEventRecord", "Staging::upload", kLeftOut)                                              \
    X(kLargeUploadLost, "large-upload-lost", "large uploads are left out", "cudaMemcpy",           \
      "device::upload", kLeftOut)                                                                  \
    X(kLargeUploadEarly, "large-upload-early", "large uploads do not wait for queued work",        \
      "cudaMemcpy", "device::upload", kEarly)                                                      \
    X(kDownloadLost, "download-lost", "copies to the host are left out", "cudaMemcpyAsync",        \
      "device::download(", kLeftOut)                                                               \
    X(kDownloadShort, "download-short", "copies to the host lack their last four bytes",           \
      "cudaMemcpyAsync", "device::download(", kShort)                                              \
    X(kDownloadEarly, "download-early", "copies to the host do not wait for queued work",          \
      "cudaMemcpyAsync", "device::download(", kEarly)                                              \
    X(kDownloadUnawaited, "download-unawaited", "copies to the host are not waited for",           \
      "cudaStreamSynchronize", "device::download(", kLeftOut)                                      \
    X(kReadbackLost, "readback-lost", "read-backs are left out", "cudaMemcpyAsync",                \
      "downloadLater", kLeftOut)                                                                   \
    X(kReadbackShort, "readback-short", "read-backs lack their last four bytes",                   \
      "cudaMemcpyAsync", "downloadLater", kShort)                                                  \
    X(kReadbackStream, "readback-stream", "read-backs are on another stream", "cudaMemcpyAsync",   \
      "downloadLater", kOtherStream)                                                               \
    X(kMarkUnawaited, "mark-unawaited", "marks in the queue are not waited for",                   \
      "cudaEventSynchronize", "waitForMark", kLeftOut)                                             \
    X(kMarkEarly, "mark-early", "marks pass before the work in front of them", "cudaEventRecord",  \
      "recordMark", kEarly)                                                                        \
    X(kCopyLost, "copy-lost", "copies on the device are left out", "cudaMemcpyAsync",              \
      "copyWithin", kLeftOut)                                                                      \
    X(kCopyShort, "copy-short", "copies on the device lack their last four bytes",                 \
      "cudaMemcpyAsync", "copyWithin", kShort)                                                     \
    X(kFillLost, "fill-lost", "fills are left out", "cudaMemsetAsync", "device::fill", kLeftOut)   \
    X(kFillShort, "fill-short", "fills lack their last four bytes", "cudaMemsetAsync",             \
      "device::fill", kShort)                                                                      \
    X(kFillStream, "fill-stream", "fills are on another stream", "cudaMemsetAsync",                \
      "device::fill", kOtherStream)                                                                \
    X(kFillEarly, "fill-early", "fills overtake queued work", "cudaMemsetAsync", "device::fill",   \
      kEarly)                                                                                      \
    X(kFreeEarly, "free-early", "memory is released before queued work has used it",               \
      "cudaFreeAsync", "device::release", kEarly)                                                  \
    X(kFreeLost, "free-lost", "memory is not released", "cudaFreeAsync", "device::release",        \
      kLeftOut)                                                                                    \
    X(kAllocationShort, "allocation-short", "allocations lack their last four bytes",              \
      "cudaMallocAsync", "device::allocate", kShort)                                               \
    X(kSynchronizeLost, "synchronize-lost", "synchronize returns at once",                         \
      "cudaDeviceSynchronize", "device::synchronize", kLeftOut)                                    \
    X(kSortKeysLost, "sort-result-lost", "sorted arrays stay in the scratch memory",               \
      "cudaMemcpyAsync", "radixSort", kLeftOut)                                                    \
    X(kSortShort, "sort-result-short", "sorted arrays lack their last four bytes",                 \
      "cudaMemcpyAsync", "radixSort", kShort)                                                      \
    X(kSumLost, "sum-lost", "the total of a scan is not computed", "DeviceReduce::Sum",            \
      "exclusiveScan", kLeftOut)                                                                   \
    X(kItemsLost, "items-lost", "passes lack their last block", "cudaLaunchKernelEx",              \
      "(unsigned long, ", kShort)                                                                  \
    X(kPassStream, "pass-stream", "passes are on another stream", "cudaLaunchKernelEx",            \
      "(unsigned long, ", kOtherStream)                                                            \
    X(kPartsLost, "parts-lost", "passes over parts are left out", "cudaLaunchKernelEx",            \
      "(shadowdag::SplitWorkView, ", kLeftOut)                                                     \
    X(kTilesLost, "tiles-lost", "the kernel of tiles lacks its last block", "cudaLaunchKernelEx",  \
      "(shadowdag::FillTile)", kShort)                                                             \
    X(kBoundsLost, "bounds-lost", "the kernel of clusters' bounds lacks its last block",           \
      "cudaLaunchKernelEx", "(shadowdag::BoundBySamples)", kShort)                                 \
    X(kFirstSyncLost, "first-sync-lost", "every first of two __syncwarp is missing", "", "",       \
      kNone)                                                                                       \
    X(kSecondSyncLost, "second-sync-lost", "every second __syncwarp is missing", "", "", kNone)    \
    X(kShuffleMaskShort, "shuffle-mask-short", "shuffles do not name lane 31", "", "", kNone)      \
    X(kShuffleLaneWrong, "shuffle-lane-wrong", "shuffles at distance 16 read the own lane", "",    \
      "", kNone)                                                                                   \
    X(kAddReturnsNew, "add-returns-new", "atomicAdd returns the new value", "", "", kNone)         \
    X(kAddLost, "add-lost", "one atomicAdd in 64 of a thread adds nothing", "", "", kNone)         \
    X(kOrLost, "or-overwrites", "atomicOr overwrites", "", "", kNone)                              \
    X(kMinIsMax, "min-is-max", "atomicMin keeps the larger value", "", "", kNone)                  \
    X(kMaxIsMin, "max-is-min", "atomicMax keeps the smaller value", "", "", kNone)                 \
    X(kFirstBitOff, "first-bit-off", "__ffs counts from 0", "", "", kNone)                         \
    X(kLeadingZerosOff, "leading-zeros-off", "__clz is one too many", "", "", kNone)

enum class Mutant : uint8_t {
    kNone,
#define SDAG_ENUMERATOR(enumerator, name, what, function, caller, fault) enumerator,
    SDAG_CUDA_HOST_MUTANTS(SDAG_ENUMERATOR)
#undef SDAG_ENUMERATOR
};

/// The mutant of this process: SDAG_CUDA_HOST_MUTANT, read before main; a name that is not in the
/// table ends the process. "list" prints the table and ends it.
extern const Mutant chosenMutant;
/// Says on stderr, the first time, that the chosen mutant changed something.
void noteMutant();

/// Returns whether this process commits a fault of lanes, and notes it.
inline bool isMutant(Mutant mutant) {
    if (chosenMutant != mutant)
        return false;
    noteMutant();
    return true;
}

/// Returns what this process does to a call of the runtime, and notes it.
Fault faultOf(const char* function, const std::string& caller);

/// Makes one call of the runtime fail, while it exists: the n-th from now on, of one function or
/// ("") of all that may fail: not those that release.
class FailCall {
public:
    FailCall(std::string function, uint64_t n, int error);
    ~FailCall();
    FailCall(const FailCall&) = delete;
    FailCall& operator=(const FailCall&) = delete;
    bool wasReached() const;
    /// Returns the function whose call failed, "" before.
    std::string reached() const;
};

/// Returns the error that a call must return, 0 for none.
int plannedError(const char* function);

/// Returns how many allocations of device memory were not released, and of pinned host memory.
struct LiveCounts {
    uint64_t device = 0, pinned = 0;
};
LiveCounts liveCounts();

} // namespace shadowdag::cuda_host
