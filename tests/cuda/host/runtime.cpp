// SPDX-License-Identifier: Apache-2.0
// The functions of tests/cuda/host/include/cuda_runtime.h: streams as queues of work, events,
// copies and memory. Work runs in the thread that waits for it, up to what it waits for.
#include "tests/cuda/host/memory.h"

#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cxxabi.h>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace shadowdag::cuda_host {

namespace {

constexpr int kProcessorCount = 3;
constexpr int kDriverVersion = 13000;
constexpr size_t kMostArgumentBytes = 4096;
// Limits of sm_75.
constexpr unsigned kMostBlocksX = 0x7fffffffu, kMostBlocksYZ = 65535, kMostThreads = 1024,
                   kMostThreadsZ = 64;
constexpr size_t kMostSharedBytes = size_t(48) << 10;

using Clock = std::chrono::steady_clock;

/// Work, and the memory of the host that it will touch.
struct Work {
    std::function<void()> run;
    const void* host = nullptr;
    size_t hostBytes = 0;
};

} // namespace

struct Stream {
    std::deque<Work> queue;
};

/// What an event knows; queued work keeps it alive.
struct EventState {
    Stream* stream = nullptr; ///< that it was recorded in last; null: never
    uint64_t recordCount = 0, passCount = 0;
    bool isTimed = true;
    Clock::time_point passed{};
};
struct Event {
    std::shared_ptr<EventState> state = std::make_shared<EventState>();
};

struct Pool {
    size_t reservedBytes = 0;
};

namespace {

struct Device {
    std::mutex mutex;
    Stream none, other; ///< the default stream, and that of mutants
    std::set<Stream*> streams{&none, &other};
    Pool pool;
    std::map<const void*, size_t> device; ///< allocations that nobody asked to release
    std::map<const void*, size_t> pinned;
    size_t usedBytes = 0;
    cudaError_t lastError = cudaSuccess;
};

Device& device() {
    static Device* const instance = [] {
        seed();
        return new Device; // work may be queued by what is destroyed last
    }();
    return *instance;
}

/// One call of the runtime: the lock, and what shall go wrong.
struct Call {
    explicit Call(const char* function, const std::source_location* from = nullptr)
        : lock(device().mutex), error(cudaError_t(plannedError(function))),
          fault(from && error == cudaSuccess ? faultOf(function, from->function_name())
                                             : Fault::kNone) {
        if (isLane())
            die(laneName() + " calls " + function);
        if (error != cudaSuccess)
            device().lastError = error;
        isOver = error != cudaSuccess || fault == Fault::kLeftOut;
    }
    std::lock_guard<std::mutex> lock;
    cudaError_t error;
    Fault fault;
    bool isOver;
};

cudaError_t fail(cudaError_t error) {
    return device().lastError = error;
}

Stream& streamOf(cudaStream_t stream) {
    Stream* const found = stream ? stream : &device().none;
    if (!device().streams.contains(found))
        die("a stream is used that does not exist");
    return *found;
}

void runNext(Stream& stream) {
    const Work work = std::move(stream.queue.front());
    stream.queue.pop_front();
    work.run();
}

/// Runs a stream's work while `isWanted`.
template <class F> void runWhile(Stream& stream, const F& isWanted) {
    if (stream.queue.empty() || !isWanted())
        return;
    const Opened opened;
    while (!stream.queue.empty() && isWanted())
        runNext(stream);
}
void runAll(Stream& stream) {
    runWhile(stream, [] { return true; });
}

/// Runs all work of all streams, taking turns by the seed.
void runEverything() {
    static uint64_t turn = seed();
    std::vector<Stream*> busy;
    std::optional<Opened> opened;
    for (;;) {
        busy.clear();
        for (Stream* stream : device().streams)
            if (!stream->queue.empty())
                busy.push_back(stream);
        if (busy.empty())
            return;
        if (!opened)
            opened.emplace();
        runNext(*busy[mixed(turn++) % busy.size()]);
    }
}

/// Queues work, or runs it at once, as the call's fault says.
void queue(const Call& call, cudaStream_t stream, Work work) {
    if (call.fault == Fault::kEarly) {
        const Opened opened;
        work.run();
        return;
    }
    Stream& wanted = streamOf(stream);
    (call.fault == Fault::kOtherStream ? device().other : wanted).queue.push_back(std::move(work));
}

std::string nameOf(const std::type_info& type) {
    int status = 0;
    char* const name = abi::__cxa_demangle(type.name(), nullptr, nullptr, &status);
    const std::string result = status == 0 ? name : type.name();
    std::free(name);
    return result;
}

/// Makes the sides of a copy less, as a fault of its call says.
void cut(Fault fault, size_t& bytes, size_t& offset) {
    const size_t cut = std::min<size_t>(bytes, 4);
    if (fault == Fault::kShort || fault == Fault::kShifted)
        bytes -= cut;
    offset = fault == Fault::kShifted ? cut : 0;
}

/// Checks the sides of a copy when it is asked for and when it is done.
void checkCopy(const char* function, void* dst, const void* src, size_t bytes,
               cudaMemcpyKind kind) {
    for (const bool isSource : {false, true}) {
        const void* const side = isSource ? src : dst;
        const std::string what = std::string(function) + (isSource ? " from" : " to");
        if (kind == cudaMemcpyDeviceToDevice || isSource == (kind == cudaMemcpyDeviceToHost))
            checkRange(side, bytes, what);
        else if (isDeviceAddress(side))
            die(what + " the host: " + describeAddress(side));
    }
}

cudaError_t take(const char* function, void** data, size_t bytes,
                 const std::source_location& from) {
    const Call call(function, &from);
    if (call.error != cudaSuccess)
        return call.error;
    if (bytes == 0)
        return fail(cudaErrorInvalidValue);
    if (bytes > kDeviceBytes - device().usedBytes)
        return fail(cudaErrorMemoryAllocation);
    size_t taken = bytes, offset = 0;
    cut(call.fault, taken, offset);
    *data = takeMemory(std::max<size_t>(taken, 1));
    device().device[*data] = bytes;
    device().usedBytes += bytes;
    device().pool.reservedBytes = std::max(device().pool.reservedBytes, device().usedBytes);
    return cudaSuccess;
}

/// Forgets an allocation, whose memory is still accessible.
void forget(const char* function, const void* data) {
    const auto found = device().device.find(data);
    if (found == device().device.end())
        die(std::string(function) +
            ": not the start of an allocation, or released twice: " + describeAddress(data));
    device().usedBytes -= found->second;
    device().device.erase(found);
}

} // namespace

LiveCounts liveCounts() {
    const std::lock_guard lock(device().mutex);
    return {device().device.size(), device().pinned.size()};
}

cudaError_t queueGrid(const cudaLaunchConfig_t& config, const std::type_info& type,
                      size_t argumentBytes, std::function<void()> lane) {
    const std::string kernel = nameOf(type);
    const Call call("cudaLaunchKernelEx", nullptr);
    const Fault fault = faultOf("cudaLaunchKernelEx", kernel);
    if (call.error != cudaSuccess || fault == Fault::kLeftOut)
        return call.error;
    dim3 blocks = config.gridDim;
    const dim3 threads = config.blockDim;
    const uint64_t threadCount = uint64_t(threads.x) * threads.y * threads.z;
    if (blocks.x == 0 || blocks.y == 0 || blocks.z == 0 || blocks.x > kMostBlocksX ||
        blocks.y > kMostBlocksYZ || blocks.z > kMostBlocksYZ || threadCount == 0 ||
        threads.x > kMostThreads || threads.y > kMostThreads || threads.z > kMostThreadsZ ||
        threadCount > kMostThreads || config.dynamicSmemBytes > kMostSharedBytes)
        return fail(cudaErrorInvalidConfiguration);
    if (argumentBytes > kMostArgumentBytes)
        die("kernel " + kernel + " has " + std::to_string(argumentBytes) +
            " bytes of parameters; a device takes " + std::to_string(kMostArgumentBytes));
    if (fault == Fault::kShort && --blocks.x == 0)
        return cudaSuccess;
    Stream& stream = fault == Fault::kOtherStream ? device().other : streamOf(config.stream);
    stream.queue.push_back({[=, lane = std::move(lane)] {
        runGrid(kernel, {blocks.x, blocks.y, blocks.z}, {threads.x, threads.y, threads.z}, lane);
        checkAround("after kernel " + kernel);
    }});
    return cudaSuccess;
}

void checkArgument(const void* argument, size_t bytes, const std::type_info& kernel) {
    const uintptr_t page = uintptr_t(sysconf(_SC_PAGESIZE));
    for (size_t at = 0; at + sizeof(uintptr_t) <= bytes; at += sizeof(uintptr_t)) {
        uintptr_t word = 0;
        std::memcpy(&word, static_cast<const char*>(argument) + at, sizeof word);
        // Programs, heaps, libraries and stacks are above 2^40; numbers and pairs of indices hardly
        // are, and then nothing is mapped there.
        if (word < uintptr_t(1) << 40 || word >= uintptr_t(1) << 47)
            continue;
        const void* const address = reinterpret_cast<const void*>(word);
        if (isDeviceAddress(address)) {
            if (bytesOfMemory(address) == 0 && describeAddress(address).ends_with("released"))
                die("kernel " + nameOf(kernel) + ": byte " + std::to_string(at) +
                    " of an argument is the address of " + describeAddress(address));
            continue;
        }
        unsigned char isResident = 0;
        if (mincore(reinterpret_cast<void*>(word / page * page), 1, &isResident) == 0)
            die("kernel " + nameOf(kernel) + ": byte " + std::to_string(at) +
                " of an argument is the address of memory that only the host has");
    }
}

cudaError_t queueLibraryCall(const char* function, const std::source_location& from, void* scratch,
                             size_t scratchBytes, std::function<void()> work) {
    const Call call(function, &from);
    if (call.isOver)
        return call.error;
    checkRange(scratch, scratchBytes, std::string("the scratch memory of ") + function);
    queue(call, nullptr, {[=, work = std::move(work)] {
              checkRange(scratch, scratchBytes, std::string("the scratch memory of ") + function);
              std::memset(scratch, 0xb7, scratchBytes); // as if it had been used
              work();
          }});
    return cudaSuccess;
}

} // namespace shadowdag::cuda_host

using namespace shadowdag::cuda_host;

cudaError_t cudaGetDeviceCount(int* count) {
    const Call call("cudaGetDeviceCount");
    if (call.error == cudaSuccess)
        *count = 1;
    return call.error;
}

cudaError_t cudaGetDevice(int* value) {
    const Call call("cudaGetDevice");
    *value = 0;
    return call.error;
}

cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
    const Call call("cudaDeviceGetAttribute");
    switch (attribute) {
    case cudaDevAttrMultiProcessorCount:
        *value = kProcessorCount;
        break;
    case cudaDevAttrMemoryPoolsSupported: {
        const char* const pools = std::getenv("SDAG_CUDA_HOST_POOLS");
        *value = !pools || std::strcmp(pools, "0") != 0;
        break;
    }
    case cudaDevAttrComputeCapabilityMajor: // sm_75, whose limits launches are checked against
        *value = 7;
        break;
    case cudaDevAttrComputeCapabilityMinor:
        *value = 5;
        break;
    }
    return call.error;
}

cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, void (*)()) {
    const Call call("cudaFuncGetAttributes");
    *attributes = {};
    return call.error;
}

cudaError_t cudaDeviceGetDefaultMemPool(cudaMemPool_t* pool, int) {
    const Call call("cudaDeviceGetDefaultMemPool");
    *pool = &device().pool;
    return call.error;
}

cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t, cudaMemPoolAttr attribute, void*) {
    const Call call("cudaMemPoolSetAttribute");
    return attribute == cudaMemPoolAttrReleaseThreshold ? call.error : fail(cudaErrorInvalidValue);
}

cudaError_t cudaMemPoolGetAttribute(cudaMemPool_t pool, cudaMemPoolAttr attribute, void* value) {
    const Call call("cudaMemPoolGetAttribute");
    const uint64_t bytes =
        attribute == cudaMemPoolAttrReservedMemCurrent ? pool->reservedBytes : device().usedBytes;
    std::memcpy(value, &bytes, sizeof bytes);
    return call.error;
}

cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int) {
    const Call call("cudaGetDeviceProperties");
    std::snprintf(properties->name, sizeof properties->name, "CUDA played by the host");
    return call.error;
}

cudaError_t cudaDriverGetVersion(int* version) {
    const Call call("cudaDriverGetVersion");
    *version = kDriverVersion;
    return call.error;
}

cudaError_t cudaGetLastError() {
    return std::exchange(device().lastError, cudaSuccess);
}

const char* cudaGetErrorString(cudaError_t error) {
    switch (error) {
    case cudaSuccess:
        return "no error";
    case cudaErrorInvalidValue:
        return "invalid argument";
    case cudaErrorMemoryAllocation:
        return "out of memory";
    case cudaErrorInvalidConfiguration:
        return "invalid configuration argument";
    case cudaErrorInsufficientDriver:
        return "CUDA driver version is insufficient for CUDA runtime version";
    case cudaErrorNoKernelImageForDevice:
        return "no kernel image is available for execution on the device";
    case cudaErrorNoDevice:
        return "no CUDA-capable device is detected";
    case cudaErrorInvalidResourceHandle:
        return "invalid resource handle";
    case cudaErrorNotReady:
        return "device not ready";
    case cudaErrorLaunchFailure:
        return "unspecified launch failure";
    }
    return "unrecognized error code";
}

cudaError_t cudaMalloc(void** data, size_t bytes, std::source_location from) {
    return take("cudaMalloc", data, bytes, from);
}

cudaError_t cudaMallocAsync(void** data, size_t bytes, cudaStream_t, std::source_location from) {
    return take("cudaMallocAsync", data, bytes, from);
}

cudaError_t cudaFree(void* data) {
    const std::lock_guard lock(device().mutex);
    runEverything();
    if (data) {
        forget("cudaFree", data);
        giveBackMemory(data);
    }
    return cudaSuccess;
}

cudaError_t cudaFreeAsync(void* data, cudaStream_t stream, std::source_location from) {
    const std::lock_guard lock(device().mutex);
    const Fault fault = faultOf("cudaFreeAsync", from.function_name());
    if (!data || fault == Fault::kLeftOut)
        return cudaSuccess;
    forget("cudaFreeAsync", data);
    if (fault == Fault::kEarly)
        giveBackMemory(data);
    else
        streamOf(stream).queue.push_back({[data] { giveBackMemory(data); }});
    return cudaSuccess;
}

cudaError_t cudaMemGetInfo(size_t* unusedBytes, size_t* totalBytes) {
    const Call call("cudaMemGetInfo");
    const char* const pools = std::getenv("SDAG_CUDA_HOST_POOLS");
    const bool hasPools = !pools || std::strcmp(pools, "0") != 0;
    *totalBytes = kDeviceBytes;
    *unusedBytes = kDeviceBytes - (hasPools ? device().pool.reservedBytes : device().usedBytes);
    return call.error;
}

cudaError_t cudaHostAlloc(void** data, size_t bytes, unsigned) {
    const Call call("cudaHostAlloc");
    if (call.error != cudaSuccess)
        return call.error;
    void* const made = std::aligned_alloc(256, (bytes + 255) / 256 * 256);
    if (!made)
        return fail(cudaErrorMemoryAllocation);
    for (size_t i = 0; i < bytes; i += sizeof kPoison)
        std::memcpy(static_cast<char*>(made) + i, &kPoison, std::min(sizeof kPoison, bytes - i));
    device().pinned[made] = bytes;
    *data = made;
    return cudaSuccess;
}

cudaError_t cudaFreeHost(void* data) {
    const std::lock_guard lock(device().mutex);
    if (!data)
        return cudaSuccess;
    const auto found = device().pinned.find(data);
    if (found == device().pinned.end())
        die("cudaFreeHost: not the start of pinned memory, or released twice");
    const char* const begin = static_cast<const char*>(data);
    for (const Stream* stream : device().streams)
        for (const Work& work : stream->queue)
            if (work.host && work.host >= begin && work.host < begin + found->second)
                die("cudaFreeHost: a queued copy still uses the memory");
    device().pinned.erase(found);
    std::free(data);
    return cudaSuccess;
}

cudaError_t cudaMemcpy(void* dst, const void* src, size_t bytes, cudaMemcpyKind kind,
                       std::source_location from) {
    const Call call("cudaMemcpy", &from);
    if (call.isOver)
        return call.error;
    checkCopy("cudaMemcpy", dst, src, bytes, kind);
    size_t offset = 0;
    cut(call.fault, bytes, offset);
    if (call.fault != Fault::kEarly)
        runAll(device().none);
    const Opened opened;
    std::memcpy(static_cast<char*>(dst) + offset, src, bytes);
    return cudaSuccess;
}

cudaError_t cudaMemcpyAsync(void* dst, const void* src, size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream, std::source_location from) {
    const Call call("cudaMemcpyAsync", &from);
    if (call.isOver)
        return call.error;
    checkCopy("cudaMemcpyAsync", dst, src, bytes, kind);
    size_t offset = 0;
    cut(call.fault, bytes, offset);
    queue(call, stream,
          {[=] {
               checkCopy("a queued copy", dst, src, bytes, kind);
               std::memcpy(static_cast<char*>(dst) + offset, src, bytes);
           },
           kind == cudaMemcpyHostToDevice   ? src
           : kind == cudaMemcpyDeviceToHost ? dst
                                            : nullptr,
           bytes});
    return cudaSuccess;
}

cudaError_t cudaMemsetAsync(void* dst, int byteValue, size_t bytes, cudaStream_t stream,
                            std::source_location from) {
    const Call call("cudaMemsetAsync", &from);
    if (call.isOver)
        return call.error;
    checkRange(dst, bytes, "cudaMemsetAsync of");
    size_t offset = 0;
    cut(call.fault, bytes, offset);
    queue(call, stream, {[=] {
              checkRange(dst, bytes, "a queued fill of");
              std::memset(static_cast<char*>(dst) + offset, byteValue, bytes);
          }});
    return cudaSuccess;
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned flags) {
    const Call call("cudaStreamCreateWithFlags");
    if (flags != cudaStreamNonBlocking)
        die("streams that wait for the default stream are not played");
    if (call.error == cudaSuccess)
        device().streams.insert(*stream = new Stream);
    return call.error;
}

cudaError_t cudaStreamDestroy(cudaStream_t stream) {
    const std::lock_guard lock(device().mutex);
    runAll(streamOf(stream));
    device().streams.erase(stream);
    delete stream;
    return cudaSuccess;
}

cudaError_t cudaStreamSynchronize(cudaStream_t stream, std::source_location from) {
    const Call call("cudaStreamSynchronize", &from);
    if (call.fault != Fault::kLeftOut) // a failure is reported by who waits for what failed
        runAll(streamOf(stream));
    return call.error;
}

cudaError_t cudaDeviceSynchronize(std::source_location from) {
    const Call call("cudaDeviceSynchronize", &from);
    if (call.fault != Fault::kLeftOut) // a failure is reported by who waits for what failed
        runEverything();
    return call.error;
}

namespace {

/// Runs what is in front of an event's last record.
void runToEvent(EventState& state, uint64_t record) {
    if (!state.stream)
        return;
    while (state.passCount < record && !state.stream->queue.empty())
        runNext(*state.stream);
    if (state.passCount < record)
        die("an event is waited for that nothing can pass");
}

} // namespace

cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
    const Call call("cudaStreamWaitEvent");
    if (call.error == cudaSuccess)
        streamOf(stream).queue.push_back(
            {[state = event->state, record = event->state->recordCount] {
                runToEvent(*state, record);
            }});
    return call.error;
}

cudaError_t cudaEventCreate(cudaEvent_t* event) {
    const Call call("cudaEventCreate");
    if (call.error == cudaSuccess)
        *event = new Event;
    return call.error;
}

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned flags) {
    const Call call("cudaEventCreateWithFlags");
    if (call.error != cudaSuccess)
        return call.error;
    *event = new Event;
    (*event)->state->isTimed = flags != cudaEventDisableTiming;
    return cudaSuccess;
}

cudaError_t cudaEventDestroy(cudaEvent_t event) {
    const std::lock_guard lock(device().mutex);
    delete event;
    return cudaSuccess;
}

cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream, std::source_location from) {
    const Call call("cudaEventRecord", &from);
    if (call.isOver)
        return call.error;
    EventState& state = *event->state;
    state.stream = &streamOf(stream);
    const uint64_t record = ++state.recordCount;
    queue(call, stream, {[kept = event->state, record] {
              kept->passCount = record;
              kept->passed = Clock::now();
          }});
    return cudaSuccess;
}

cudaError_t cudaEventSynchronize(cudaEvent_t event, std::source_location from) {
    const Call call("cudaEventSynchronize", &from);
    if (call.fault == Fault::kLeftOut)
        return cudaSuccess;
    EventState& state = *event->state;
    if (!state.stream || state.passCount == state.recordCount)
        return call.error;
    const Opened opened;
    runToEvent(state, state.recordCount);
    return call.error;
}

cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t begin, cudaEvent_t end) {
    const Call call("cudaEventElapsedTime");
    if (call.error != cudaSuccess)
        return call.error;
    for (const Event* event : {begin, end})
        if (!event->state->isTimed || event->state->recordCount == 0)
            return fail(cudaErrorInvalidResourceHandle);
        else if (event->state->passCount != event->state->recordCount)
            return fail(cudaErrorNotReady);
    *ms =
        std::chrono::duration<float, std::milli>(end->state->passed - begin->state->passed).count();
    return cudaSuccess;
}

void cudaHostNameMemory(void* data, const char* name) {
    nameMemory(data, name);
}
