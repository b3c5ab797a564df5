// SPDX-License-Identifier: Apache-2.0
// The program's side of the module sdag_openvdb: loads it, and owns the files that it writes.
#include "voxel/openvdb_file.h"

#include "cuda/error.h"
#include "cuda/thread_refusal.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "scenes/write_remedy.h"
#include "voxel/nano_grid.h"
#include "voxel/openvdb_module.h"

#include <dlfcn.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <latch>
#include <memory>
#include <new>
#include <thread>
#include <vector>

namespace shadowdag {
namespace {

/// The module, or why it cannot be loaded.
struct Loading {
    const OpenVdbModule* module = nullptr;
    std::exception_ptr failure{};
};

Error notLoaded(const std::string& why) {
    return Error(ErrorKind::kResource, std::string(kOpenVdbModuleFile) +
                                           ": the module for OpenVDB's grids cannot be loaded: " +
                                           why + "; install the program and libopenvdb again");
}

/// Starts as many threads as the initializer of liblog4cplus does (OpenVDB's messages go through
/// it), and ends them: where one of its own cannot start, it waits for the others without end.
/// Their stacks and heaps stay in the caches of the C library, from which the next threads take
/// them. Throws std::system_error where a thread, std::bad_alloc where memory is lacking.
void proveThreadsStart() {
    constexpr int kThreads = 4; // LOG4CPLUS_THREADPOOL_SIZE of its builds
    // Address space that the module and its libraries take: 80 MiB with those of Debian 12.
    constexpr size_t kLibraryBytes = size_t(128) << 20;
    void* const space =
        mmap(nullptr, kLibraryBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (space == MAP_FAILED)
        throw std::bad_alloc();
    const auto unmap = [](void* pages) { munmap(pages, kLibraryBytes); };
    const std::unique_ptr<void, decltype(unmap)> kept(space, unmap);
    std::latch haveHeaps(kThreads), end(1);
    std::vector<std::jthread> threads;
    threads.reserve(kThreads);
    const auto letEnd = [](std::latch* latch) { latch->count_down(); };
    const std::unique_ptr<std::latch, decltype(letEnd)> ended(&end, letEnd); // before the threads
    for (int i = 0; i < kThreads; ++i)
        threads.emplace_back([&] {
            void* volatile byte = std::malloc(1); // gives the thread its heap
            std::free(byte);
            haveHeaps.count_down();
            end.wait();
        });
    haveHeaps.wait();
}

Loading load() {
    try {
        proveThreadsStart();
        void* const library = dlopen(kOpenVdbModuleFile, RTLD_NOW | RTLD_LOCAL);
        void* const function = library ? dlsym(library, kOpenVdbModuleFunction) : nullptr;
        if (!function) {
            const char* const said = dlerror();
            const std::string why = said ? said : "it is damaged";
            if (saysTooManyFiles(why))
                throw TooManyFiles(ErrorKind::kResource, std::string(kOpenVdbModuleFile) +
                                                             ": cannot be loaded: " + why + "; " +
                                                             kMoreFilesRemedy);
            throw notLoaded(why);
        }
        const OpenVdbModule* const module =
            reinterpret_cast<decltype(&sdagOpenVdbModule)>(function)();
        if (module->layout != OpenVdbModuleLayout())
            throw notLoaded("it is of another version");
        return {module};
    } catch (...) {
        return {nullptr, std::current_exception()};
    }
}

/// Returns the module, which the first call loads from the folder that the program's run path
/// names. It is never unloaded, and a failure stays: where an initializer of a library throws, its
/// libraries are half made. Throws Error kResource, and what their initializers throw without
/// memory or threads.
const OpenVdbModule& openVdb() {
    static const Loading loading = load();
    if (loading.failure)
        std::rethrow_exception(loading.failure);
    return *loading.module;
}

/// Opens the file behind an OutputFile and calls write(out), which writes through libraries with
/// their own exceptions. A full disk throws.
void runWriter(const std::string& path, const OutputFile& file, const VdbWriter& write) {
    std::ofstream out; // closed only after errno is read
    out.exceptions(std::ios::failbit | std::ios::badbit);
    errno = 0;
    try {
        out.open(file.temporaryPath(), std::ios::binary | std::ios::trunc);
        write(out);
        out.close();
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::ios::failure& error) { // whose text gives no reason
        const int failure = errno;
        refuseTooManyFiles(path, failure);
        throw Error(ErrorKind::kResource, path + ": cannot be written: " +
                                              (failure ? std::strerror(failure) : error.what()) +
                                              "; " + writeRemedy(failure));
    } catch (const std::exception& error) {
        if (saysNoThread(error)) // which is not of the disk
            throw;
        throw Error(ErrorKind::kResource,
                    path + ": cannot be written: " + error.what() + "; " + writeRemedy(errno));
    }
}

/// Writes a file by a call of the module. Returns its size in bytes.
uint64_t writeBy(void (*write)(const Asset&, const std::string&, const VdbSink&),
                 const Asset& asset, const std::string& path) {
    write(asset, path, [&](const VdbWriter& writeGrid) {
        OutputFile file(path);
        runWriter(path, file, writeGrid);
        file.commit();
    });
    return std::filesystem::file_size(path);
}

} // namespace

void loadOpenVdb() {
    static_cast<void>(openVdb());
}

uint64_t writeOpenVdb(const Asset& asset, const std::string& path) {
    return writeBy(openVdb().writeOpenVdb, asset, path);
}

uint64_t writeNanoVdb(const Asset& asset, const std::string& path) {
    return writeBy(openVdb().writeNanoVdb, asset, path);
}

nanovdb::GridHandle<> nanoGridOf(const Dag& dag) {
    return openVdb().nanoGridOf(dag);
}

VdbSource readOpenVdb(std::istream& in, uint64_t byteCount, const std::string& name,
                      const std::string& gridName) {
    return openVdb().readOpenVdb(in, byteCount, name, gridName);
}

} // namespace shadowdag
