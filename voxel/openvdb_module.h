// SPDX-License-Identifier: Apache-2.0
// The calls of the module sdag_openvdb, a shared library that is loaded when the first grid is
// read, written or made. The relocations of libopenvdb take 50 ms, more than all else that most
// commands do at their start, and few of them need it. Others call it by openvdb_file.h.
//
// Both sides are built together, by one compiler: C++ types and exceptions pass between them. The
// module has its own copies of our functions, so state that is one for the program (open output
// files, counters) stays on the program's side.
#pragma once

#include "voxel/vdb_source.h"

#include <nanovdb/util/GridHandle.h>

#include <cstddef>
#include <functional>
#include <iosfwd>

namespace shadowdag {

/// Writes a grid to a stream that throws when the disk is full.
using VdbWriter = std::function<void(std::ostream&)>;
/// Opens the file and calls the writer once.
using VdbSink = std::function<void(const VdbWriter&)>;

/// The sizes of what passes between the two sides.
struct OpenVdbModuleLayout {
    size_t asset = sizeof(Asset), dag = sizeof(Dag), source = sizeof(VdbSource),
           handle = sizeof(nanovdb::GridHandle<>);
    bool operator==(const OpenVdbModuleLayout&) const = default;
};

struct OpenVdbModule {
    OpenVdbModuleLayout layout; ///< as the module was compiled; an older one may have another
    /// Call the sink when the grid is made. Throw Error kInput for voxels too small for a grid's
    /// transform. @param path for messages
    void (*writeOpenVdb)(const Asset& asset, const std::string& path, const VdbSink& sink);
    void (*writeNanoVdb)(const Asset& asset, const std::string& path, const VdbSink& sink);
    nanovdb::GridHandle<> (*nanoGridOf)(const Dag& dag); ///< as voxel/nano_grid.h
    /// As voxel/openvdb_file.h.
    VdbSource (*readOpenVdb)(std::istream& in, uint64_t byteCount, const std::string& name,
                             const std::string& gridName);
};

/// The names of the module's file and of the only function that it exports.
inline constexpr const char* kOpenVdbModuleFile = "sdag_openvdb.so";
inline constexpr const char* kOpenVdbModuleFunction = "sdagOpenVdbModule";

} // namespace shadowdag

/// Returns the module's calls, which are valid as long as it is loaded.
extern "C" const shadowdag::OpenVdbModule* sdagOpenVdbModule();
