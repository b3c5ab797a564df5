// SPDX-License-Identifier: Apache-2.0
#undef _FORTIFY_SOURCE // its longjmp takes another fiber's stack for a mistake
#include "tests/cuda/host/lanes.h"

#include "tests/cuda/host/memory.h"

#include <algorithm>
#include <atomic>
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
    bool isUsed = false;
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
    std::atomic<uint64_t> nextBlock{0};

    uint64_t blockCount() const { return uint64_t(blocks.x) * blocks.y * blocks.z; }
    unsigned threadCount() const { return threads.x * threads.y * threads.z; }
    /// Returns the block that is started as the i-th: a permutation, i * a + b modulo their number,
    /// with a coprime to it.
    uint64_t blockOf(uint64_t i) const {
        const uint64_t count = blockCount();
        uint64_t a = mixed(seed) % count;
        while (std::gcd(a, count) != 1)
            ++a;
        return uint64_t((static_cast<unsigned __int128>(i) * a + mixed(seed + 1)) % count);
    }
};

Index3 indexIn(uint64_t i, const Index3& size) {
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
        uint64_t met[kWarpLanes];
    };

    static void fiberMain() {
#if defined(SDAG_FIBERS_ASAN)
        __sanitizer_finish_switch_fiber(nullptr, nullptr, nullptr);
#endif
        for (;;)
            here().runNewLanes();
    }
    static BlockRunner& here();
    void runNewLanes();
    void begin(unsigned lane);
    void leave(unsigned lane);
    Fiber& unusedFiber();
    bool isComplete(unsigned lane) const;
    void release(unsigned lane);
    [[noreturn]] void dieOfWaits() const;
    uint64_t random() {
        return mixed(random_++);
    }

    const Grid* grid_ = nullptr;
    uint64_t block_ = 0;
    std::vector<Lane> lanes_;
    std::vector<unsigned> order_; ///< of lanes that are new from begunCount_ on
    std::vector<unsigned> mayGo_; ///< lanes whose waits are over
    std::vector<std::unique_ptr<Fiber>> fibers_;
    Fiber home_;             ///< the thread's own stack
    Fiber* fiber_ = nullptr; ///< that runs
    unsigned begunCount_ = 0, leftCount_ = 0, current_ = 0;
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
    for (Lane& lane : lanes_)
        lane.state = State::kNew;
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0u);
    for (unsigned i = count; i > 1; --i)
        std::swap(order_[i - 1], order_[random() % i]);
    begunCount_ = leftCount_ = 0;
#if defined(SDAG_FIBERS_TSAN)
    home_.tsanFiber = __tsan_get_current_fiber();
#elif defined(SDAG_FIBERS_ASAN)
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstack(&attributes, &home_.stack, &home_.stackBytes);
    pthread_attr_destroy(&attributes);
#endif
    runner = this;
    while (leftCount_ < count) {
        const bool hasNew = begunCount_ < count;
        if (mayGo_.empty() && !hasNew)
            dieOfWaits();
        if (mayGo_.empty() || (hasNew && random() % 2 == 0)) {
            fiber_ = &unusedFiber();
            fiber_->isUsed = true;
        } else {
            std::swap(mayGo_[random() % mayGo_.size()], mayGo_.back());
            current_ = mayGo_.back();
            mayGo_.pop_back();
            fiber_ = lanes_[current_].fiber;
        }
        switchFibers(home_, *fiber_);
    }
    runner = nullptr;
    grid_ = nullptr;
}

/// Runs lanes on the current fiber until there is no new one, or one waits.
void BlockRunner::runNewLanes() {
    while (begunCount_ < lanes_.size()) {
        const unsigned lane = order_[begunCount_++];
        begin(lane);
        grid_->lane();
        leave(current_);
    }
    fiber_->isUsed = false;
    switchFibers(*fiber_, home_);
}

void BlockRunner::begin(unsigned lane) {
    current_ = lane;
    lanes_[lane].state = State::kRuns;
    lanes_[lane].fiber = fiber_;
    threadIdx = indexIn(lane, grid_->threads);
    blockIdx = indexIn(block_, grid_->blocks);
    blockDim = grid_->threads;
    gridDim = grid_->blocks;
}

void BlockRunner::leave(unsigned lane) {
    lanes_[lane].state = State::kLeft;
    ++leftCount_;
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    for (unsigned other = warp; other < std::min(warp + kWarpLanes, unsigned(lanes_.size()));
         ++other)
        if (lanes_[other].state == State::kWaits && lanes_[other].meeting != Meeting::kSyncBlock &&
            (lanes_[other].mask >> (lane - warp) & 1u))
            die(nameOf(lane) + " left, although thread " + std::to_string(other) +
                " waits for it, whose mask names it");
    for (unsigned other = 0; other < lanes_.size() && leftCount_ < begunCount_; ++other)
        if (lanes_[other].state == State::kWaits && lanes_[other].meeting == Meeting::kSyncBlock) {
            if (isComplete(other))
                release(other);
            break;
        }
}

Fiber& BlockRunner::unusedFiber() {
    for (const auto& fiber : fibers_)
        if (!fiber->isUsed)
            return *fiber;
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
    return fiber;
}

/// Returns whether all that a waiting lane waits for wait for the same.
bool BlockRunner::isComplete(unsigned lane) const {
    const Lane& mine = lanes_[lane];
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    if (mine.meeting == Meeting::kSyncBlock)
        return std::all_of(lanes_.begin(), lanes_.end(), [](const Lane& other) {
            return other.state == State::kLeft ||
                   (other.state == State::kWaits && other.meeting == Meeting::kSyncBlock);
        });
    for (unsigned i = 0; i < kWarpLanes; ++i)
        if (mine.mask >> i & 1u) {
            const Lane& other = lanes_[warp + i];
            if (other.state != State::kWaits || other.meeting != mine.meeting ||
                other.mask != mine.mask)
                return false;
        }
    return true;
}

/// Ends the waits of the lanes that met with a lane.
void BlockRunner::release(unsigned lane) {
    const unsigned warp = lane / kWarpLanes * kWarpLanes;
    const bool isBlock = lanes_[lane].meeting == Meeting::kSyncBlock;
    const uint32_t mask = lanes_[lane].mask;
    for (unsigned i = 0; i < (isBlock ? unsigned(lanes_.size()) : kWarpLanes); ++i) {
        const unsigned other = isBlock ? i : warp + i;
        if (isBlock ? lanes_[other].state != State::kWaits : !(mask >> i & 1u))
            continue;
        for (unsigned j = 0; j < kWarpLanes && !isBlock; ++j)
            lanes_[other].met[j] = mask >> j & 1u ? lanes_[warp + j].value : kPoison;
        lanes_[other].state = State::kMayGoOn;
        mayGo_.push_back(other);
    }
}

const uint64_t* BlockRunner::meet(Meeting meeting, uint32_t mask, uint64_t value) {
    const unsigned me = current_, warp = me / kWarpLanes * kWarpLanes;
    Lane& lane = lanes_[me];
    if (meeting != Meeting::kSyncBlock) {
        if (!(mask >> (me - warp) & 1u))
            die(nameOf(me) + " meets by a mask that does not name it");
        for (unsigned i = 0; i < kWarpLanes; ++i)
            if ((mask >> i & 1u) &&
                (warp + i >= lanes_.size() || lanes_[warp + i].state == State::kLeft))
                die(nameOf(me) + " waits for lane " + std::to_string(i) +
                    " of its warp, which its mask names, but which has left");
    }
    lane.state = State::kWaits;
    lane.meeting = meeting;
    lane.mask = mask;
    lane.value = value;
    if (isComplete(me))
        release(me);
    switchFibers(*lane.fiber, home_);
    threadIdx = indexIn(me, grid_->threads); // the other places are those of the whole block
    lanes_[me].state = State::kRuns;
    return lanes_[me].met;
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
        if (grid.blockCount() > 1 && hasThreads_) {
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
        const uint64_t count = grid.blockCount();
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
