// SPDX-License-Identifier: Apache-2.0
#include "python/dag_object.h"

#include "cuda/cancel.h"
#include "cuda/parallel_for.h"
#include "python/arrays.h"
#include "python/call.h"
#include "python/errors.h"
#include "python/json_object.h"
#include "tools/workspace/asset_json.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/dag_lod.h"
#include "voxel/dag_stream.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace shadowdag::python {

namespace {

/// Segments that one thread traces together: few enough for its stack.
constexpr size_t kBlock = 256;

DagSegment voxelSegment(const VoxelGrid& grid, const glm::vec3& from, const glm::vec3& to) {
    DagSegment segment;
    segment.from = glm::vec3(grid.voxelFromWorld(glm::dvec3(from)));
    segment.to = glm::vec3(grid.voxelFromWorld(glm::dvec3(to)));
    return segment;
}

/// Returns the wide form, built at the first call. It is built without the lock, since signal
/// handlers, which are Python, run meanwhile and may ask for it as well.
const WideDag& wideOf(DagObject& self) {
    {
        const std::lock_guard lock(self.wideMutex);
        if (self.wide)
            return *self.wide;
    }
    auto made = std::make_unique<const WideDag>(buildWideDag(*self.dag));
    const std::lock_guard lock(self.wideMutex);
    if (!self.wide)
        self.wide = std::move(made);
    return *self.wide;
}

py::array_t<bool> occludedBy(DagObject& self, const py::array& start, const py::array& end,
                             uint32_t level, const py::object& out, const py::object& progress) {
    const PointsOf from(start, "start"), to(end, "end");
    const size_t count = segmentCount(from, to);
    py::array_t<bool> result = resultOf(out, count);
    bool* const blocked = result.mutable_data();
    Call call("trace segments", progress);
    call.run([&] {
        DagView view = self.dag->view();
        view.wide = wideOf(self).view();
        cpuParallelRanges(
            (count + kBlock - 1) / kBlock, 1, [&](size_t firstBlock, size_t endBlock) {
                DagSegment segments[kBlock];
                uint8_t answers[kBlock];
                for (size_t first = firstBlock * kBlock; first < std::min(count, endBlock * kBlock);
                     first += kBlock) {
                    const size_t n = std::min(kBlock, count - first);
                    for (size_t i = 0; i < n; ++i)
                        segments[i] = voxelSegment(view.grid, from[first + i], to[first + i]);
                    if (level == 0)
                        traceStream(view, {segments, n}, {answers, n});
                    else
                        for (size_t i = 0; i < n; ++i)
                            answers[i] = occluded(view, segments[i], level);
                    for (size_t i = 0; i < n; ++i)
                        blocked[first + i] = answers[i] != 0;
                }
            });
    });
    return result;
}

/// Returns the addresses of the nodes of each level, the root's first: ascending, as they stand.
std::vector<std::vector<uint32_t>> levelAddresses(const Dag& dag) {
    std::vector<std::vector<uint32_t>> levels;
    if (dag.empty())
        return levels;
    levels.push_back({dag.rootAddress});
    for (uint32_t level = dag.grid.resolutionLog2; level > kLeafLog2; --level) {
        std::vector<uint32_t> below;
        pollCpu();
        for (const uint32_t address : levels.back()) {
            const uint32_t childCount = bitCount32(dag.words[address]);
            below.insert(below.end(), dag.words.begin() + address + 1,
                         dag.words.begin() + address + 1 + childCount);
        }
        std::sort(below.begin(), below.end());
        below.erase(std::unique(below.begin(), below.end()), below.end());
        levels.push_back(std::move(below));
    }
    return levels;
}

/// Nodes that a walk visits between two polls: a few milliseconds.
constexpr uint64_t kVisitsBetweenPolls = 1 << 16;

/// Returns the cells of a level that hold a voxel, (count, 3), in the order of a walk.
py::array cellsOf(const DagObject& self, uint32_t level, uint64_t maxCount) {
    const Dag& dag = *self.dag;
    if (level < kLeafLog2 || level > std::max(dag.grid.resolutionLog2, kLeafLog2))
        throw py::value_error("level " + std::to_string(level) + ": must be from " +
                              std::to_string(kLeafLog2) + ", the cells of 4^3 voxels, to " +
                              std::to_string(std::max(dag.grid.resolutionLog2, kLeafLog2)));
    struct Open {
        uint32_t address, level;
        glm::uvec3 cell;
    };
    auto cells = std::make_shared<std::vector<glm::uvec3>>();
    std::vector<Open> open;
    if (!dag.empty())
        open.push_back({dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2), {}});
    Call call("list cells", py::none());
    call.run([&] {
        for (uint64_t visited = 0; !open.empty(); ++visited) {
            if (visited % kVisitsBetweenPolls == 0)
                pollCpu();
            const Open at = open.back();
            open.pop_back();
            if (at.level == level) {
                if (cells->size() >= maxCount)
                    throw Error(ErrorKind::kResource,
                                "level " + std::to_string(level) +
                                    " has more than max_count = " + std::to_string(maxCount) +
                                    " cells; choose a higher level or raise it");
                cells->push_back(at.cell);
                continue;
            }
            const uint32_t mask = dag.words[at.address];
            uint32_t next = at.address + bitCount32(mask);
            for (uint32_t c = 8; c-- > 0;)
                if (mask >> c & 1)
                    open.push_back({dag.words[next--], at.level - 1,
                                    at.cell * 2u + glm::uvec3(c & 1, c >> 1 & 1, c >> 2 & 1)});
        }
    });
    return arrayOver3(cells->data(), cells->size(), cells);
}

std::shared_ptr<DagObject> loadAsset(const py::object& file, const py::object& progress) {
    const std::string path = pathOf(file);
    Call call("read " + path, progress);
    return call.run([&] {
        Asset asset = readAsset(path);
        return std::make_shared<DagObject>(std::make_shared<const Dag>(std::move(asset.dag)),
                                           asset.provenance, std::filesystem::file_size(path));
    });
}

void save(DagObject& self, const py::object& file, const std::string& packing,
          const py::object& progress) {
    const std::string path = pathOf(file);
    if (std::filesystem::path(path).extension() != ".svdag")
        throw Error(ErrorKind::kUsage,
                    "'" + path + "': assets are .svdag files; use that extension");
    const AssetPacking chosen = parsePacking(packing);
    checkWritable(path);
    Call call("write " + path, progress);
    call.run([&] {
        const Asset asset{*self.dag, self.provenance};
        self.fileBytes = writeAsset(asset, path, chosen);
    });
}

} // namespace

void addDag(py::module_& scope) {
    py::class_<DagObject, std::shared_ptr<DagObject>>(
        scope, "Dag",
        "Voxels of a scene as a directed acyclic graph; immutable. Made by Scene.voxelize and "
        "load_asset.")
        .def("occluded", &occludedBy, py::arg("start"), py::arg("end"), py::arg("level") = 0,
             py::arg("out") = py::none(), py::arg("progress") = py::none(),
             "Returns for each segment whether an occupied voxel touches it: bool, (n,).\n\n"
             "start, end: float32, world units, (n, 3), or (3,) for one point for all; used where "
             "they lie, whatever their strides; other types are TypeError, not converted. Segments "
             "are used as given: no offset lifts them off a surface. Ends that are not finite give "
             "True.\nlevel: cells of 2**level voxels instead of voxels.\nout: receives the result; "
             "contiguous bool, (n,).\nDeterministic, on all CPU threads, without the interpreter's "
             "lock.")
        .def("save", &save, py::arg("path"), py::arg("packing") = "compact",
             py::arg("progress") = py::none(),
             "Writes the asset file, whole or not at all. packing: 'compact', or 'fast', about "
             "twice the bytes, read sixty times as fast. Raises UsageError for another extension "
             "than .svdag, ResourceError where the disk refuses.")
        .def(
            "info",
            [](const DagObject& self) {
                Call call("count nodes", py::none());
                const DagStats stats = call.run([&] { return computeDagStats(*self.dag); });
                return toPython(assetJson(stats, self.dag->grid, self.provenance, self.fileBytes));
            },
            "Returns what `shadowdag info --json` says: resolution, voxel_count, node_counts, "
            "leaf_count, asset_bytes (0 for voxels of no file), traced_bytes, voxel_size_world, "
            "origin_world, provenance.")
        .def_property_readonly(
            "resolution", [](const DagObject& self) { return self.dag->grid.resolution(); },
            "Voxels an axis.")
        .def_property_readonly(
            "voxel_size", [](const DagObject& self) { return self.dag->grid.voxelSizeWorld; },
            "Side of a voxel, world units.")
        .def_property_readonly(
            "origin",
            [](const DagObject& self) {
                const glm::dvec3 o = self.dag->grid.originWorld;
                return py::make_tuple(o.x, o.y, o.z);
            },
            "Least corner of the grid, world units.")
        .def_property_readonly(
            "words", [](const DagObject& self) { return arrayOver(self.dag->words, self.dag); },
            "The words of all nodes, uint32, read-only, without a copy; voxel/dag.h draws them.")
        .def_property_readonly(
            "root", [](const DagObject& self) { return self.dag->rootAddress; },
            "Index of the root's first word; 0xffffffff without voxels.")
        .def_property_readonly(
            "levels",
            [](const DagObject& self) {
                py::list levels;
                Call call("list nodes", py::none());
                auto found = call.run([&] { return levelAddresses(*self.dag); });
                for (std::vector<uint32_t>& addresses : found) {
                    const auto kept = std::make_shared<std::vector<uint32_t>>(std::move(addresses));
                    levels.append(arrayOver(*kept, kept));
                }
                return levels;
            },
            "The unique nodes of each level, the root's first, leaves of 4^3 voxels last: arrays "
            "of uint32, indices into words.")
        .def("cells", &cellsOf, py::arg("level") = kLeafLog2, py::arg("max_count") = 10'000'000,
             "Returns the cells of 2**level voxels a side that hold a voxel: uint32, (n, 3); a "
             "cell's least corner is origin + cell * 2**level * voxel_size. Raises ResourceError "
             "beyond max_count.");
    scope.def("load_asset", &loadAsset, py::arg("path"), py::arg("progress") = py::none(),
              "Reads an asset file (.svdag) and returns its Dag, all of it verified. Raises "
              "InputError naming the file and what is wrong with it.");
}

} // namespace shadowdag::python
