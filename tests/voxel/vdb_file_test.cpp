// SPDX-License-Identifier: Apache-2.0
// Assets as .vdb and .nvdb files, compared with the voxels that OpenVDB and NanoVDB read from them.
// Long because both formats are tested in the same ways, with the same helpers.
#include "voxel/vdb_file.h"

#include "cuda/error.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/openvdb_file.h"

#define NANOVDB_USE_ZIP
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/PointIndexGrid.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <streambuf>
#include <system_error>

namespace shadowdag {
namespace {

using Bytes = std::vector<char>;
using testing::HasSubstr;

/// A path that is removed with the object.
struct TempFile {
    std::string path;
    explicit TempFile(const std::string& name)
        : path((std::filesystem::temp_directory_path() /
                ("shadowdag_vdb_" + std::to_string(getpid()) + "_" + name))
                   .string()) {}
    ~TempFile() { std::filesystem::remove(path); }
    Bytes read() const {
        std::ifstream in(path, std::ios::binary);
        return Bytes(std::istreambuf_iterator<char>(in), {});
    }
    void write(const Bytes& bytes) const {
        std::ofstream(path, std::ios::binary | std::ios::trunc)
            .write(bytes.data(), std::streamsize(bytes.size()));
    }
};

constexpr const char* kEndings[] = {".vdb", ".nvdb"};

Asset assetWith(Dag dag) {
    Asset asset;
    asset.dag = std::move(dag);
    asset.dag.grid.originWorld = {-1.5, 2.3, 1e5};
    asset.dag.grid.voxelSizeWorld = 0.0073;
    asset.provenance = {"sample.glb", "0123456789abcdef0123456789abcdef", "0.1.0", "a\nb=\"c\""};
    return asset;
}

Asset sampleAsset(uint32_t log2, double density, unsigned seed) {
    std::mt19937 random(seed);
    return assetWith(dagOf(randomGrid(log2, density, random)));
}

bool isEqual(const Asset& a, const Asset& b) {
    return a.dag.words == b.dag.words && a.dag.rootAddress == b.dag.rootAddress &&
           a.dag.grid == b.dag.grid && a.provenance.sceneName == b.provenance.sceneName &&
           a.provenance.sceneHash == b.provenance.sceneHash &&
           a.provenance.programVersion == b.provenance.programVersion &&
           a.provenance.options == b.provenance.options;
}

/// Returns what reading a file says, "" when it succeeds.
std::string messageOf(const std::string& path, const VdbReadOptions& options = {},
                      ErrorKind kind = ErrorKind::kInput) {
    try {
        readVdb(path, options);
        return "";
    } catch (const Error& error) {
        EXPECT_EQ(int(error.kind()), int(kind)) << error.what();
        return error.what();
    }
}

void writeGrids(const std::string& path, const openvdb::GridPtrVec& grids) {
    openvdb::initialize();
    openvdb::io::File(path).write(grids);
}

openvdb::FloatGrid::Ptr oneVoxel(const openvdb::Coord& at = openvdb::Coord(0)) {
    auto grid = openvdb::FloatGrid::create();
    grid->tree().setValue(at, 1.0f);
    grid->setName("density");
    return grid;
}

/// Every VDB tree tests: leaves, tiles of all three sizes, nodes that begin below 0.
openvdb::FloatGrid::Ptr wildGrid() {
    auto grid = openvdb::FloatGrid::create(0.5f);
    grid->setName("wild");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
    grid->transform().postTranslate(openvdb::Vec3d(10, 20, 30));
    std::mt19937 random(11);
    auto accessor = grid->getAccessor();
    for (int i = 0; i < 500; ++i)
        accessor.setValue(openvdb::Coord(int(random() % 90) - 45, int(random() % 60) - 50,
                                         int(random() % 40) - 3),
                          float(i % 3)); // some have the background's value, and are active
    grid->tree().addTile(1, openvdb::Coord(64, -64, 8), 0.0f, true);
    grid->tree().addTile(2, openvdb::Coord(128, 128, 128), 2.0f, true);
    grid->tree().addTile(1, openvdb::Coord(-128, 0, 0), 7.0f, false);
    return grid;
}

TEST(VdbFile, RoundTripGivesTheSameAsset) {
    for (const char* ending : kEndings) {
        const TempFile file(std::string("round_trip") + ending);
        for (uint32_t log2 = 0; log2 <= 6; ++log2)
            for (const double density : {0.0, 0.03, 0.5, 1.0}) {
                SCOPED_TRACE(std::to_string(log2) + " " + std::to_string(density) + ending);
                const Asset asset = sampleAsset(log2, density, log2);
                const uint64_t bytes = writeVdb(asset, file.path);
                EXPECT_EQ(bytes, std::filesystem::file_size(file.path));
                const VdbAsset found = readVdb(file.path, {});
                EXPECT_TRUE(isEqual(found.asset, asset));
                EXPECT_FALSE(found.isForeign);
                EXPECT_EQ(found.gridName, "sample.glb");
            }
    }
}

TEST(VdbFile, RoundTripKeepsGridsOfAnyScale) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        Asset asset = assetWith(dagOf(randomGrid(3, 0.2, random)));
        std::uniform_real_distribution<double> unit(-1, 1);
        // OpenVDB refuses transforms of small determinants.
        asset.dag.grid.voxelSizeWorld = std::exp2(15 * unit(random));
        for (int axis = 0; axis < 3; ++axis)
            asset.dag.grid.originWorld[axis] = unit(random) * std::exp2(40 * unit(random));
        const TempFile file(std::string("scale") + kEndings[seed % 2]);
        writeVdb(asset, file.path);
        EXPECT_TRUE(isEqual(readVdb(file.path, {}).asset, asset));
    }
    for (const char* ending : kEndings) {
        Asset tiny = sampleAsset(3, 0.2, 1);
        tiny.dag.grid.voxelSizeWorld = 1e-20;
        const TempFile file(std::string("tiny") + ending);
        try {
            writeVdb(tiny, file.path);
            FAIL() << "written";
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("cannot hold voxels of 1e-20 m"));
        }
    }
}

TEST(VdbFile, SameAssetGivesTheSameBytes) {
    for (const char* ending : kEndings) {
        const TempFile a(std::string("same_a") + ending), b(std::string("same_b") + ending);
        writeVdb(sampleAsset(5, 0.05, 1), a.path);
        writeVdb(sampleAsset(5, 0.05, 1), b.path);
        EXPECT_EQ(a.read(), b.read()) << ending;
    }
}

TEST(VdbFile, OpenVdbReadsTheSameVoxelsInTheSamePlace) {
    const TempFile file("open.vdb");
    const Asset asset = sampleAsset(5, 0.1, 3);
    writeVdb(asset, file.path);
    openvdb::initialize();
    openvdb::io::File open(file.path);
    open.open();
    const auto grid = openvdb::gridPtrCast<openvdb::MaskGrid>(open.readGrid("sample.glb"));
    EXPECT_EQ(grid->activeVoxelCount(), computeDagStats(asset.dag).voxelCount);
    for (int z = -1; z < 33; ++z)
        for (int y = -1; y < 33; ++y)
            for (int x = -1; x < 33; ++x)
                ASSERT_EQ(grid->tree().isValueOn(openvdb::Coord(x, y, z)),
                          isOccupied(asset.dag.view(), uint32_t(x), uint32_t(y), uint32_t(z)));
    const openvdb::Vec3d centre = grid->indexToWorld(openvdb::Coord(1, 2, 3));
    const glm::dvec3 ours = asset.dag.grid.worldFromVoxel({1.5, 2.5, 3.5});
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(centre[axis], ours[axis], 1e-9);
}

TEST(VdbFile, NanoVdbReadsTheSameVoxelsInTheSamePlace) {
    const TempFile file("nano.nvdb");
    const Asset asset = sampleAsset(5, 0.1, 3);
    writeVdb(asset, file.path);
    const auto handle = nanovdb::io::readGrid(file.path);
    const auto* grid = handle.grid<nanovdb::ValueMask>();
    ASSERT_NE(grid, nullptr);
    EXPECT_STREQ(grid->gridName(), "sample.glb");
    EXPECT_TRUE(nanovdb::validateChecksum(*grid, nanovdb::ChecksumMode::Full));
    EXPECT_EQ(grid->activeVoxelCount(), computeDagStats(asset.dag).voxelCount);
    for (int z = -1; z < 33; ++z)
        for (int y = -1; y < 33; ++y)
            for (int x = -1; x < 33; ++x)
                ASSERT_EQ(grid->tree().isActive(nanovdb::Coord(x, y, z)),
                          isOccupied(asset.dag.view(), uint32_t(x), uint32_t(y), uint32_t(z)));
    const nanovdb::Vec3d centre = grid->indexToWorld(nanovdb::Vec3d(1, 2, 3));
    const glm::dvec3 ours = asset.dag.grid.worldFromVoxel({1.5, 2.5, 3.5});
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(centre[axis], ours[axis], 1e-9);
}

TEST(VdbFile, WhollyOccupiedCellsAreTiles) {
    // 2^39 voxels, all but the way to one leaf with two of them: nothing may be expanded.
    constexpr uint32_t kLevel = 13;
    DagBuilder builder(kLevel);
    uint32_t full = builder.addLeaf(~uint64_t(0)), node = builder.addLeaf(3);
    for (uint32_t level = kLeafLog2 + 1; level <= kLevel; ++level) {
        uint32_t children[8];
        std::fill_n(children, 8, full);
        full = builder.addInner(level, children);
        children[6] = node;
        node = builder.addInner(level, children);
    }
    VoxelGrid grid;
    grid.resolutionLog2 = kLevel;
    const Asset asset = assetWith(builder.finish(kLevel, node, grid));
    for (const char* ending : kEndings) {
        const TempFile file(std::string("tiles") + ending);
        writeVdb(asset, file.path);
        EXPECT_TRUE(isEqual(readVdb(file.path, {}).asset, asset)) << ending;
        EXPECT_LT(std::filesystem::file_size(file.path), 1u << 20);
    }
}

TEST(VdbFile, AForeignGridGivesItsActiveVoxelsInTheSmallestCube) {
    const auto grid = wildGrid();
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    const TempFile open("wild.vdb"), nano("wild.nvdb");
    writeGrids(open.path, {grid});
    nanovdb::io::writeGrid(nano.path, nanovdb::openToNanoVDB(*grid));
    for (const TempFile* file : {&open, &nano}) {
        VdbReadOptions options;
        options.programVersion = "9.9";
        const VdbAsset found = readVdb(file->path, options);
        EXPECT_TRUE(found.isForeign);
        EXPECT_EQ(found.cornerIndex, glm::ivec3(box.min().x(), box.min().y(), box.min().z()));
        const Dag& dag = found.asset.dag;
        EXPECT_EQ(dag.grid.resolution(), 512u); // 301 indices: from -45 to 255
        EXPECT_EQ(computeDagStats(dag).voxelCount, grid->activeVoxelCount());
        for (auto value = grid->cbeginValueOn(); value; ++value) {
            openvdb::CoordBBox cells;
            value.getBoundingBox(cells);
            for (const openvdb::Coord& at : {cells.min(), cells.max()}) {
                const openvdb::Coord p = at - box.min();
                EXPECT_TRUE(
                    isOccupied(dag.view(), uint32_t(p.x()), uint32_t(p.y()), uint32_t(p.z())));
            }
        }
        // Index i lies at 0.25 i + 10: the corner of its cube half a voxel before.
        EXPECT_DOUBLE_EQ(dag.grid.voxelSizeWorld, 0.25);
        EXPECT_DOUBLE_EQ(dag.grid.originWorld.x, 10 + 0.25 * (box.min().x() - 0.5));
        EXPECT_DOUBLE_EQ(dag.grid.originWorld.z, 30 + 0.25 * (box.min().z() - 0.5));
        EXPECT_EQ(found.asset.provenance.sceneHash, "none");
        EXPECT_EQ(found.asset.provenance.programVersion, "9.9");
        EXPECT_THAT(found.asset.provenance.options, HasSubstr("imported grid 'wild'"));
        EXPECT_THAT(found.asset.provenance.options,
                    HasSubstr("voxel 0 is index (" + std::to_string(box.min().x()) + ", "));
    }
}

template <class Grid> void expectOneVoxel(const typename Grid::ValueType& value) {
    const TempFile file("type.vdb");
    auto grid = Grid::create();
    grid->tree().setValue(openvdb::Coord(-7, 5, 100000), value);
    writeGrids(file.path, {grid});
    const VdbAsset found = readVdb(file.path, {});
    EXPECT_EQ(computeDagStats(found.asset.dag).voxelCount, 1u) << found.gridType;
    EXPECT_EQ(found.asset.dag.grid.resolution(), 4u);
    EXPECT_EQ(found.cornerIndex, glm::ivec3(-7, 5, 100000));
}

TEST(VdbFile, GridsOfEveryValueTypeAreRead) {
    expectOneVoxel<openvdb::BoolGrid>(false); // active, whatever its value
    expectOneVoxel<openvdb::FloatGrid>(1.0f);
    expectOneVoxel<openvdb::DoubleGrid>(1.0);
    expectOneVoxel<openvdb::Int32Grid>(1);
    expectOneVoxel<openvdb::Int64Grid>(1);
    expectOneVoxel<openvdb::Vec3SGrid>(openvdb::Vec3s(1));
    expectOneVoxel<openvdb::MaskGrid>(true);
}

TEST(VdbFile, HalfFloatsStreamsAndSharedTreesAreRead) {
    openvdb::initialize();
    const TempFile file("kinds.vdb");
    auto half = wildGrid();
    half->setSaveFloatAsHalf(true);
    writeGrids(file.path, {half});
    const VdbAsset expected = readVdb(file.path, {});
    // Without offsets, as io::Stream writes.
    std::ofstream out(file.path, std::ios::binary | std::ios::trunc);
    auto copy = oneVoxel();
    openvdb::io::Stream(out).write(openvdb::GridPtrVec{copy, wildGrid()});
    out.close();
    EXPECT_EQ(readVdb(file.path, {.gridName = "wild"}).asset.dag.words, expected.asset.dag.words);
    auto shared = openvdb::FloatGrid::create(wildGrid()->treePtr());
    shared->setName("first");
    auto instance = openvdb::FloatGrid::create(shared->treePtr());
    instance->setName("second");
    writeGrids(file.path, {shared, instance});
    EXPECT_EQ(readVdb(file.path, {.gridName = "second"}).asset.dag.words, expected.asset.dag.words);
}

TEST(VdbFile, OfSeveralGridsOneMustBeNamed) {
    const TempFile file("several.vdb"), nano("several.nvdb");
    auto a = oneVoxel(), b = oneVoxel(openvdb::Coord(9, 9, 9)), twin = oneVoxel();
    b->setName("heat");
    writeGrids(file.path, {a, b, twin});
    EXPECT_THAT(messageOf(file.path, {}, ErrorKind::kUsage), HasSubstr("--grid NAME"));
    EXPECT_THAT(messageOf(file.path, {}, ErrorKind::kUsage), HasSubstr("'heat'"));
    EXPECT_THAT(messageOf(file.path, {.gridName = "smoke"}, ErrorKind::kUsage),
                HasSubstr("no grid 'smoke'"));
    EXPECT_EQ(readVdb(file.path, {.gridName = "heat"}).cornerIndex, glm::ivec3(9));
    EXPECT_EQ(readVdb(file.path, {.gridName = "density[1]"}).cornerIndex, glm::ivec3(0));
    std::vector<nanovdb::GridHandle<>> handles;
    handles.push_back(nanovdb::openToNanoVDB(*a));
    handles.push_back(nanovdb::openToNanoVDB(*b));
    nanovdb::io::writeGrids(nano.path, handles);
    EXPECT_THAT(messageOf(nano.path, {}, ErrorKind::kUsage), HasSubstr("--grid NAME"));
    EXPECT_EQ(readVdb(nano.path, {.gridName = "heat"}).cornerIndex, glm::ivec3(9));
}

TEST(VdbFile, UnsupportedGridsAreRefusedWithAReason) {
    openvdb::initialize();
    const TempFile file("refused.vdb");
    const auto refuse = [&](const openvdb::GridBase::Ptr& grid, const char* message) {
        writeGrids(file.path, {grid});
        EXPECT_THAT(messageOf(file.path), HasSubstr(message));
    };
    writeGrids(file.path, {});
    EXPECT_THAT(messageOf(file.path), HasSubstr("holds no grid"));
    refuse(openvdb::FloatGrid::create(), "no active voxel");
    auto grid = oneVoxel();
    grid->transform().preRotate(0.5);
    refuse(grid, "rotates");
    grid = oneVoxel();
    grid->transform().preScale(openvdb::Vec3d(1, 1, 1.5));
    refuse(grid, "unevenly (voxel 1.000000 x 1.000000 x 1.500000)");
    grid = oneVoxel();
    grid->transform().preScale(openvdb::Vec3d(-1, -1, -1));
    refuse(grid, "mirrors");
    grid = oneVoxel();
    grid->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(100)), 0.5, 10.0));
    refuse(grid, "rotates, shears");
    grid = oneVoxel();
    grid->tree().setValue(openvdb::Coord(131072, 0, 0), 1.0f);
    refuse(grid, "spread over 131073 indices");
    grid->tree().setValue(openvdb::Coord(1 << 30, 0, 0), 1.0f);
    refuse(grid, "more than the 131072");
    refuse(openvdb::tools::PointIndexGrid::create(), "whose voxels are not its content");
    EXPECT_THAT(messageOf("/nonexistent/a.vdb"), HasSubstr("cannot be opened"));
    EXPECT_THAT(messageOf("a.abc", {}, ErrorKind::kUsage), HasSubstr(".nvdb (NanoVDB)"));
    for (const char* ending : kEndings) {
        const TempFile text(std::string("text") + ending);
        text.write(Bytes(1000, 'x'));
        EXPECT_THAT(messageOf(text.path), HasSubstr("not a ."));
        text.write({});
        EXPECT_NE(messageOf(text.path), "");
    }
}

TEST(VdbFile, AnEditedExportIsImportedOnlyOnRequest) {
    const TempFile file("edited.vdb");
    const Asset asset = sampleAsset(4, 0.1, 5);
    writeVdb(asset, file.path);
    openvdb::io::File open(file.path);
    open.open();
    auto grid = openvdb::gridPtrCast<openvdb::MaskGrid>(open.readGrid("sample.glb"));
    open.close();
    const auto edit = [&](const std::function<void(openvdb::MaskGrid&)>& change) {
        auto edited = grid->deepCopy();
        change(*edited);
        writeGrids(file.path, {edited});
        EXPECT_THAT(messageOf(file.path), HasSubstr("--edited"));
        const VdbAsset found = readVdb(file.path, {.acceptEdited = true});
        EXPECT_TRUE(found.isForeign);
    };
    edit([](openvdb::MaskGrid& g) { g.tree().setValueOn(openvdb::Coord(100, 0, 0)); });
    edit([](openvdb::MaskGrid& g) { g.tree().setValueOn(openvdb::Coord(-1, 0, 0)); });
    edit([](openvdb::MaskGrid& g) { g.tree().setValueOff(g.cbeginValueOn().getCoord()); });
    edit([](openvdb::MaskGrid& g) { g.transform().postTranslate(openvdb::Vec3d(1, 0, 0)); });
    edit([](openvdb::MaskGrid& g) { g.transform().preScale(2.0); });
}

enum class Outcome { kSame, kRefused, kOther, kCrashed };

/// Reads a file and holds it against an asset.
Outcome outcomeOf(const std::string& path, const Asset& whole) {
    try {
        return isEqual(readVdb(path, {}).asset, whole) ? Outcome::kSame : Outcome::kOther;
    } catch (const Error&) {
        return Outcome::kRefused;
    }
}

/// The same in a process of its own: OpenVDB may write past its buffers.
Outcome outcomeInChild(const std::string& path, const Asset& whole) {
    const pid_t child = fork();
    if (child == 0) {
        const int nowhere = open("/dev/null", O_WRONLY); // for malloc's last words
        dup2(nowhere, STDERR_FILENO);
        alarm(60);
        _exit(int(outcomeOf(path, whole)));
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_FALSE(WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) << "hangs";
    return WIFEXITED(status) ? Outcome(WEXITSTATUS(status)) : Outcome::kCrashed;
}

using Reading = Outcome (*)(const std::string& path, const Asset& whole);

/// Feeds truncations and bit flips, as often in the head, which holds the sizes, as in all of the
/// file. Returns how often each outcome came out.
std::map<Outcome, int> damage(const TempFile& file, Reading read) {
    const Asset whole = readVdb(file.path, {}).asset;
    const Bytes bytes = file.read();
    std::map<Outcome, int> counts;
    for (size_t count = 0; count < bytes.size(); count += 1 + bytes.size() / 50) {
        file.write(Bytes(bytes.begin(), bytes.begin() + std::ptrdiff_t(count)));
        const Outcome outcome = read(file.path, whole);
        EXPECT_TRUE(outcome == Outcome::kRefused || outcome == Outcome::kCrashed)
            << count << " of " << bytes.size() << " bytes";
        ++counts[outcome];
    }
    std::mt19937 random(17);
    for (int i = 0; i < 200; ++i) {
        Bytes damaged = bytes;
        const size_t at = random() % (i % 2 ? bytes.size() : std::min<size_t>(bytes.size(), 1500));
        damaged[at] = char(damaged[at] ^ (1 << random() % 8));
        file.write(damaged);
        ++counts[read(file.path, whole)];
    }
    return counts;
}

TEST(VdbFile, DamageToAnExportIsDetected) {
    for (const char* ending : kEndings) {
        SCOPED_TRACE(ending);
        const TempFile file(std::string("damage") + ending);
        writeVdb(sampleAsset(5, 0.02, 9), file.path);
        const bool isNano = std::string(ending) == ".nvdb";
        std::map<Outcome, int> counts = damage(file, isNano ? outcomeOf : outcomeInChild);
        EXPECT_EQ(counts[Outcome::kOther], 0);
        EXPECT_GT(counts[Outcome::kRefused], 100);
        RecordProperty("crashes" + std::to_string(isNano), counts[Outcome::kCrashed]);
    }
}

TEST(VdbFile, DamageToAForeignNanoVdbGridIsDetected) {
    const TempFile file("foreign.nvdb");
    nanovdb::io::writeGrid(file.path, nanovdb::openToNanoVDB(*oneVoxel(), nanovdb::StatsMode::All,
                                                             nanovdb::ChecksumMode::Full));
    std::map<Outcome, int> counts = damage(file, outcomeOf);
    EXPECT_EQ(counts[Outcome::kOther], 0);
    EXPECT_GT(counts[Outcome::kRefused], 100);
}

TEST(VdbFile, DamageToAForeignOpenVdbGridEndsInAnErrorOrInVoxels) {
    const TempFile file("foreign.vdb");
    writeGrids(file.path, {wildGrid()});
    std::map<Outcome, int> counts = damage(file, outcomeInChild);
    EXPECT_GT(counts[Outcome::kRefused], 50);
    RecordProperty("crashes", counts[Outcome::kCrashed]);
}

TEST(VdbFile, AGridLargerThanTheMachineIsRefused) {
    // 8 voxels of a cell at each of 2^42 places: one node a level, and no tile.
    DagBuilder builder(kMaxResolutionLog2);
    uint32_t address = builder.addLeaf(0xff);
    for (uint32_t level = kLeafLog2 + 1; level <= kMaxResolutionLog2; ++level) {
        uint32_t children[8];
        std::fill_n(children, 8, address);
        address = builder.addInner(level, children);
    }
    VoxelGrid grid;
    grid.resolutionLog2 = kMaxResolutionLog2;
    const TempFile file("huge.vdb");
    try {
        writeVdb(assetWith(builder.finish(kMaxResolutionLog2, address, grid)), file.path);
        FAIL() << "written";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_THAT(error.what(), HasSubstr("GiB of memory, this machine has"));
    }
    EXPECT_FALSE(std::filesystem::exists(file.path));
}

/// A stream that throws what a library throws while it reads.
template <class Exception> class Throwing : public std::streambuf {
public:
    explicit Throwing(const Exception& exception) : exception_(exception) {}

private:
    int_type underflow() override { throw exception_; }
    std::streamsize xsgetn(char*, std::streamsize) override { throw exception_; }
    Exception exception_;
};

/// Returns the kind of the Error that readOpenVdb throws after an exception while it reads; nothing
/// if it throws that exception itself.
template <class Exception> std::optional<ErrorKind> kindAfter(const Exception& exception) {
    Throwing<Exception> buffer(exception);
    std::istream in(&buffer);
    try {
        readOpenVdb(in, 1000, "a.vdb", "");
        ADD_FAILURE() << "was read";
    } catch (const Error& error) {
        return error.kind();
    } catch (const Exception& thrown) {
        EXPECT_STREQ(thrown.what(), exception.what());
    }
    return std::nullopt;
}

// The program reports it as a lack of resources, not as a damaged file.
TEST(VdbFile, AThreadThatCannotStartIsNoFaultOfTheFile) {
    const std::string no = "pthread_create has failed: Resource temporarily unavailable";
    EXPECT_EQ(kindAfter(std::runtime_error(no)), std::nullopt);
    EXPECT_EQ(kindAfter(std::system_error(EAGAIN, std::generic_category())), std::nullopt);
    EXPECT_EQ(kindAfter(std::runtime_error("a value is wrong")), ErrorKind::kInput);
}

TEST(VdbFile, AFullDiskLeavesNoPartialFile) {
    // A limit on the size of files stands for the full disk.
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{4096, old.rlim_max};
    const auto oldHandler = std::signal(SIGXFSZ, SIG_IGN);
    for (const char* ending : kEndings) {
        const TempFile file(std::string("full") + ending);
        const Asset asset = sampleAsset(6, 0.1, 1);
        setrlimit(RLIMIT_FSIZE, &small);
        std::string message;
        try {
            writeVdb(asset, file.path);
        } catch (const Error& error) {
            message = error.what();
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
        }
        setrlimit(RLIMIT_FSIZE, &old);
        EXPECT_THAT(message, HasSubstr("cannot be written"));
        EXPECT_FALSE(std::filesystem::exists(file.path));
    }
    std::signal(SIGXFSZ, oldHandler);
}

} // namespace
} // namespace shadowdag
