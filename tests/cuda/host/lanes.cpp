// SPDX-License-Identifier: Apache-2.0
#undef _FORTIFY_SOURCE // its longjmp takes another fiber's stack for a mistake
#include "tests/cuda/host/lanes.h"

#include "tests/cuda/host/memory.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <condition_variable>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <numeric>
#include <pthread.h>
#include <sys/mman.h>
#include <thread>
#include <ucontext.h>
#include <unistd.h>
#include <vector>

#if defined(__SANITIZE_ADDRESS__)
#define SDAG_FIBERS_ASAN 1
#elif defined(__SANITIZE_THREAD__)
#define SDAG_FIBERS_TSAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SDAG_FIBERS_ASAN 1
#elif __has_feature(thread_sanitizer)
#define SDAG_FIBERS_TSAN 1
#endif
#endif
#if defined(SDAG_FIBERS_ASAN)
#include <sanitizer/common_interface_defs.h>
#elif defined(SDAG_FIBERS_TSAN)
#include <sanitizer/tsan_interface.h>
#endif

namespace shadowdag::cuda_host {

namespace {

constexpr size_t kStackBytes = size_t(256) << 10;

/// A stack, and where its execution stands.
struct Fiber {
    ucontext_t context{};
    void* stack = nullptr; ///< none: a thread's own
    size_t stackBytes = 0;
    std::jmp_buf place; ///< where it goes on, once it has begun
    bool hasBegun = false;
#if defined(SDAG_FIBERS_ASAN)
    void* fakeStack = nullptr;
#elif defined(SDAG_FIBERS_TSAN)
    void* tsanFiber = nullptr;
#endif
};

void switchFibers(Fiber& from, Fiber& to) {
#if defined(SDAG_FIBERS_ASAN)
    __sanitizer_start_switch_fiber(&from.fakeStack, to.stack, to.stackBytes);
    swapcontext(&from.context, &to.context);
    __sanitizer_finish_switch_fiber(from.fakeStack, nullptr, nullptr);
#elif defined(SDAG_FIBERS_TSAN)
    __tsan_switch_to_fiber(to.tsanFiber, 0);
    swapcontext(&from.context, &to.context);
#else
    // swapcontext asks the system for the signal mask: half of the time of kernels of warps.
    if (_setjmp(from.place) != 0)
        return;
    if (to.stack == nullptr || to.hasBegun)
        _longjmp(to.place, 1);
    to.hasBegun = true;
    setcontext(&to.context);
#endif
}

/// The blocks of one kernel.
struct Grid {
    const std::string& kernel;
    Index3 blocks, threads;
    const std::function<void()>& lane;
    uint64_t seed;
    uint64_t blockCount = uint64_t(blocks.x) * blocks.y * blocks.z;
    uint64_t stride = coprimeTo(blockCount, mixed(seed));
    std::atomic<uint64_t> nextBlock{0};

    unsigned threadCount() const { return threads.x * threads.y * threads.z; }
    /// Returns the block that is started as the i-th: a permutation.
    uint64_t blockOf(uint64_t i) const {
        const auto product = static_cast<unsigned __int128>(i) * stride;
        return uint64_t((product + mixed(seed + 1)) % blockCount);
    }
    static uint64_t coprimeTo(uint64_t count, uint64_t start) {
        uint64_t a = start % count;
        while (std::gcd(a, count) != 1)
            ++a;
        return a;
    }
};

Index3 indexIn(uint64_t i, const Index3& size) {
    if (i < size.x)
        return {unsigned(i), 0, 0}; // without a division, as most
    return {unsigned(i % size.x), unsigned(i / size.x % size.y), unsigned(i / size.x / size.y)};
}

/// Runs blocks on one thread, one after the other.
class BlockRunner {
public:
    void run(const Grid& grid, uint64_t block);

    const uint64_t* meet(Meeting meeting, uint32_t mask, uint64_t value);
    std::string nameOf(unsigned lane) const;
    const Grid* grid() const { return grid_; }
    std::string laneName() const { return nameOf(current_); }

private:
    enum class State : uint8_t { kNew, kRuns, kWaits, kMayGoOn, kLeft };
    struct Lane {
        State state = State::kNew;
        Meeting meeting = Meeting::kSyncWarp;
        uint32_t mask = 0;
        uint64_t value = 0;
        Fiber* fiber = nullptr;
    };
    /// One bit a lane.
    struct Warp {
        uint32_t absent = 0; ///< left, or beyond the end of the block
        uint32_t waits = 0;
    };
    using Values = std::array<uint64_t, kWarpLanes>;

    static void fiberMain() {
#if defined(SDAG_FIBERS_ASAN)
        __sanitizer_finish_switch_fiber(nullptr, nullptr, nullptr);
#endif
        for (;;)
            here().runNewLanes();
    }
    static BlockRunner& here();
    Fiber& next();
    void runNewLanes();
    void begin(unsigned lane);
    void leave(unsigned lane);
    Fiber& unusedFiber();
    void addFiber();
    bool isComplete(unsigned lane) const;
    void release(unsigned lane);
    [[noreturn]] void dieOfWaits() const;
    /// Returns a random number below `count`.
    unsigned below(size_t count) {
        return unsigned(static_cast<unsigned __int128>(mixed(random_++)) * count >> 64);
    }

    const Grid* grid_ = nullptr;
    uint64_t block_ = 0;
    std::vector<Lane> lanes_;
    std::vector<Warp> warps_;
    std::vector<Values> met_;     ///< of each lane that met others of its warp
    std::vector<unsigned> order_; ///< of lanes that are new from begunCount_ on
    std::vector<unsigned> mayGo_; ///< lanes whose waits are over
    std::vector<std::unique_ptr<Fiber>> fibers_;
    std::vector<Fiber*> unused_; ///< of fibers_
    Fiber home_;                 ///< the thread's own stack
    Fiber* fiber_ = nullptr;     ///< that runs
    unsigned begunCount_ = 0, leftCount_ = 0, current_ = 0;
    unsigned waitCount_ = 0, blockWaitCount_ = 0; ///< lanes that wait, and for the whole block
    uint64_t random_ = 0;
};

thread_local BlockRunner* runner = nullptr; // that runs a lane

BlockRunner& BlockRunner::here() {
    return *runner;
}

void BlockRunner::run(const Grid& grid, uint64_t block) {
    grid_ = &grid;
    block_ = block;
    random_ = mixed(grid.seed ^ mixed(block));
    const unsigned count = grid.threadCount();
    lanes_.resize(count);
    met_.resize(count);
    warps_.assign((count + kWarpLanes - 1) / kWarpLanes, {});
    if (count % kWarpLanes != 0)
        warps_.back().absent = ~0u << count % kWarpLanes;
    for (Lane& lane : lanes_)
        lane.state = State::kNew;
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0u);
    for (unsigned i = count; i > 1; --i)
        std::swap(order_[i - 1], order_[below(i)]);
    begunCount_ = leftCount_ = 0;
    blockIdx = indexIn(block_, grid.blocks);
    blockDim = grid.threads;
    gridDim = grid.blocks;
#if defined(SDAG_FIBERS_TSAN)
    home_.tsanFiber = __tsan_get_current_fiber();
#elif defined(SDAG_FIBERS_ASAN)
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstack(&attributes, &home_.stack, &home_.stackBytes);
    pthread_attr_destroy(&attributes);
#endif
    runner = this;
    switchFibers(home_, next());
    runner = nullptr;
    grid_ = nullptr;
}

/// Returns the fiber that runs next: of a lane whose wait is over, one for new lanes, or at the end
/// the thread's own.
Fiber& BlockRunner::next() {
    const bool hasNew = begunCount_ < lanes_.size();
    if (leftCount_ == lanes_.size())
        return home_;
    if (mayGo_.empty() && !hasNew)
        dieOfWaits();
    if (mayGo_.empty() || (hasNew && below(2) == 0)) {
        fiber_ = &unusedFiber();
    } else {
        std::swap(mayGo_[below(mayGo_.size())], mayGo_.back());
        current_ = mayGo_.back();
        mayGo_.pop_back();
        fiber_ = lanes_[current_].fiber;
    }
    return *fiber_;
}

/// Runs lanes on the current fiber until there is no new one, or one waits.
void BlockRunner::runNewLanes() {
    while (begunCount_ < lanes_.size()) {
        const unsigned lane = order_[begunCount_++];
        begin(lane);
        grid_->lane();
        leave(current_);
    }
    Fiber& mine = *fiber_;
    unused_.push_back(&mine);
    switchFibers(mine, next());
}

void BlockRunner::begin(unsigned lane) {
    current_ = lane;
    lanes_[lane].state = State::kRuns;
    lanes_[lane].fiber = fiber_;
    threadIdx = indexIn(lane, grid_->threads);
}

void BlockRunner::leave(unsigned lane) {
    lanes_[lane].state = State::kLeft;
    ++leftCount_;
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    warps_[warp / kWarpLanes].absent |= 1u << (lane - warp);
    if (waitCount_ == 0)
        return;
    for (uint32_t waits = warps_[warp / kWarpLanes].waits; waits != 0; waits &= waits - 1) {
        const unsigned other = warp + unsigned(std::countr_zero(waits));
        if (lanes_[other].meeting != Meeting::kSyncBlock &&
            (lanes_[other].mask >> (lane - warp) & 1u))
            die(nameOf(lane) + " left, although thread " + std::to_string(other) +
                " waits for it, whose mask names it");
    }
    for (unsigned other = 0; blockWaitCount_ + leftCount_ == lanes_.size(); ++other)
        if (lanes_[other].state == State::kWaits) {
            release(other);
            break;
        }
}

Fiber& BlockRunner::unusedFiber() {
    if (unused_.empty())
        addFiber();
    Fiber& fiber = *unused_.back();
    unused_.pop_back();
    return fiber;
}

void BlockRunner::addFiber() {
    const size_t page = size_t(sysconf(_SC_PAGESIZE));
    fibers_.push_back(std::make_unique<Fiber>());
    Fiber& fiber = *fibers_.back();
    char* const stack =
        static_cast<char*>(mmap(nullptr, kStackBytes + page, PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
    if (stack == MAP_FAILED || mprotect(stack, page, PROT_NONE) != 0)
        die("there is no memory for the stack of a lane");
    fiber.stack = stack + page;
    fiber.stackBytes = kStackBytes;
    getcontext(&fiber.context);
    fiber.context.uc_stack.ss_sp = fiber.stack;
    fiber.context.uc_stack.ss_size = fiber.stackBytes;
    makecontext(&fiber.context, &BlockRunner::fiberMain, 0);
#if defined(SDAG_FIBERS_TSAN)
    fiber.tsanFiber = __tsan_create_fiber(0);
#endif
    unused_.push_back(&fiber);
}

/// Returns whether all that a waiting lane waits for wait for the same.
bool BlockRunner::isComplete(unsigned lane) const {
    const Lane& mine = lanes_[lane];
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    if (mine.meeting == Meeting::kSyncBlock)
        return blockWaitCount_ + leftCount_ == lanes_.size();
    if ((mine.mask & ~warps_[warp / kWarpLanes].waits) != 0)
        return false;
    for (uint32_t mask = mine.mask; mask != 0; mask &= mask - 1) {
        const Lane& other = lanes_[warp + unsigned(std::countr_zero(mask))];
        if (other.meeting != mine.meeting || other.mask != mine.mask)
            return false;
    }
    return true;
}

/// Ends the waits of the lanes that met with a lane.
void BlockRunner::release(unsigned lane) {
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    const bool isBlock = lanes_[lane].meeting == Meeting::kSyncBlock;
    const uint32_t mask = lanes_[lane].mask;
    Values values;
    for (unsigned i = 0; i < kWarpLanes && !isBlock; ++i)
        values[i] = mask >> i & 1u ? lanes_[warp + i].value : kPoison;
    for (unsigned i = 0; i < (isBlock ? unsigned(lanes_.size()) : kWarpLanes); ++i) {
        const unsigned other = isBlock ? i : warp + i;
        if (isBlock ? lanes_[other].state != State::kWaits : !(mask >> i & 1u))
            continue;
        if (!isBlock)
            met_[other] = values;
        lanes_[other].state = State::kMayGoOn;
        warps_[other / kWarpLanes].waits &= ~(1u << other % kWarpLanes);
        mayGo_.push_back(other);
        --waitCount_;
    }
    if (isBlock)
        blockWaitCount_ = 0;
}

const uint64_t* BlockRunner::meet(Meeting meeting, uint32_t mask, uint64_t value) {
    const unsigned me = current_, warp = me / kWarpLanes * kWarpLanes;
    Lane& lane = lanes_[me];
    if (meeting != Meeting::kSyncBlock) {
        if (!(mask >> (me - warp) & 1u))
            die(nameOf(me) + " meets by a mask that does not name it");
        if (const uint32_t absent = mask & warps_[warp / kWarpLanes].absent)
            die(nameOf(me) + " waits for lane " + std::to_string(std::countr_zero(absent)) +
                " of its warp, which its mask names, but which has left");
    }
    lane.state = State::kWaits;
    lane.meeting = meeting;
    lane.mask = mask;
    lane.value = value;
    warps_[warp / kWarpLanes].waits |= 1u << (me - warp);
    ++waitCount_;
    blockWaitCount_ += meeting == Meeting::kSyncBlock;
    if (isComplete(me))
        release(me);
    if (Fiber& other = next(); &other != lane.fiber)
        switchFibers(*lane.fiber, other);
    threadIdx = indexIn(me, grid_->threads); // the other places are those of the whole block
    lane.state = State::kRuns;
    return met_[me].data();
}

std::string BlockRunner::nameOf(unsigned lane) const {
    const auto text = [](const Index3& i) {
        return "(" + std::to_string(i.x) + ", " + std::to_string(i.y) + ", " + std::to_string(i.z) +
               ")";
    };
    return "kernel " + grid_->kernel + ", block " + text(indexIn(block_, grid_->blocks)) +
           ", thread " + text(indexIn(lane, grid_->threads));
}

void BlockRunner::dieOfWaits() const {
    std::string waiting;
    unsigned count = 0;
    for (unsigned lane = 0; lane < lanes_.size(); ++lane)
        if (lanes_[lane].state == State::kWaits && count++ < 4)
            waiting += (waiting.empty() ? "" : ", ") + std::to_string(lane);
    die(nameOf(0) + ": " + std::to_string(count) +
        " threads of the block wait for others that never come, among them " + waiting);
}

/// Threads that run blocks, besides the one that starts a grid; they live as long as the process.
class Workers {
public:
    static constexpr unsigned kCount = 2;

    static Workers& get() {
        static Workers* const workers = new Workers;
        return *workers;
    }

    void run(Grid& grid) {
        const std::lock_guard one(oneGrid_);
        if (grid.blockCount > 1 && hasThreads_) {
            const std::lock_guard lock(mutex_);
            grid_ = &grid;
            busyCount_ = kCount;
            ++gridNumber_;
            begun_.notify_all();
        }
        runBlocks(grid);
        std::unique_lock lock(mutex_);
        ended_.wait(lock, [&] { return busyCount_ == 0; });
        grid_ = nullptr;
    }

private:
    Workers() {
        for (unsigned i = 0; i < kCount; ++i)
            std::thread([this] { work(); }).detach();
        // The child of a fork, as death tests make, has none of them.
        pthread_atfork(nullptr, nullptr, [] { get().hasThreads_ = false; });
    }
    static void runBlocks(Grid& grid) {
        thread_local BlockRunner* const mine = new BlockRunner; // its stacks stay, as threads do
        useSignalStack();
        const uint64_t count = grid.blockCount;
        for (uint64_t i; (i = grid.nextBlock.fetch_add(1)) < count;)
            mine->run(grid, grid.blockOf(i));
    }
    void work() {
        uint64_t seen = 0;
        for (;;) {
            Grid* grid = nullptr;
            {
                std::unique_lock lock(mutex_);
                begun_.wait(lock, [&] { return gridNumber_ != seen; });
                seen = gridNumber_;
                grid = grid_;
            }
            runBlocks(*grid);
            const std::lock_guard lock(mutex_);
            if (--busyCount_ == 0)
                ended_.notify_all();
        }
    }

    std::mutex oneGrid_, mutex_;
    std::condition_variable begun_, ended_;
    Grid* grid_ = nullptr;
    uint64_t gridNumber_ = 0;
    unsigned busyCount_ = 0;
    bool hasThreads_ = true;
};

std::atomic<uint64_t> gridCount{0};

} // namespace

void runGrid(const std::string& kernel, Index3 blocks, Index3 threads,
             const std::function<void()>& lane) {
    Grid grid{kernel, blocks, threads, lane, mixed(seed() + gridCount++)};
    Workers::get().run(grid);
}

bool isLane() {
    return runner != nullptr;
}

std::string laneName() {
    return runner->laneName();
}

const uint64_t* meet(Meeting meeting, uint32_t mask, uint64_t value) {
    if (!isLane())
        die("the host calls a function that only lanes of a kernel call");
    return runner->meet(meeting, mask, value);
}

void trap(const char* file, int line) {
    die((isLane() ? laneName() : std::string("the host")) + ": assertion failed at " + file + ":" +
        std::to_string(line));
}

void die(const std::string& message) {
    std::fprintf(stderr, "cuda host: %s\n", message.c_str());
    std::abort();
}

uint64_t seed() {
    static const uint64_t value = [] {
        const char* const text = std::getenv("SDAG_CUDA_HOST_SEED");
        const uint64_t number = text ? std::strtoull(text, nullptr, 10) : 1;
        std::fprintf(stderr,
                     "cuda host: CUDA is played by the host, order by seed %llu "
                     "(SDAG_CUDA_HOST_SEED)\n",
                     static_cast<unsigned long long>(number));
        return number;
    }();
    return value;
}

} // namespace shadowdag::cuda_host
