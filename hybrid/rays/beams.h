// SPDX-License-Identifier: Apache-2.0
// Beams: for a cell of surface and a light, which triangles may block a ray between them, kept from
// frame to frame. All rays from the cell to the light lie in the convex hull of both. Most of these
// hulls meet no triangle, or one that blocks all of their rays; the others list a few. Exact rays
// (exact_stream.h) are then answered without a search, with the same answers, while the static
// geometry and the light stand still. A beam belongs to the surface, not to the view. Sources:
// Arvo, Kirk, Fast Ray Tracing by Ray Classification, SIGGRAPH 1987 (candidates of beams, found
// when they are asked for); Haines, Wallace, Shaft Culling for Efficient Ray-Cast Radiosity, 1991;
// Haines, Greenberg, The Light Buffer, 1986.
#pragma once

#include "hybrid/rays/triangle_bvh.h"
#include "scenes/box.h"
#include "scenes/light.h"
#include "voxel/dag_stream.h"

#include <atomic>
#include <memory>
#include <vector>

namespace shadowdag {

/// The plane of a receiver, towards its starts.
struct BeamPlane {
    glm::dvec3 normal;
    double below; ///< normal . p of points that lie below every ray of a beam

    bool operator==(const BeamPlane&) const = default;
};

/// The planes of the receivers in a cell; of more than kMax none are kept.
struct BeamPlanes {
    static constexpr uint32_t kMax = 8;

    BeamPlane planes[kMax];
    uint32_t count = 0; ///< kMax + 1: more

    bool areMany() const { return count > kMax; }
    void add(const BeamPlane& plane);
};

enum class BeamKind : uint8_t {
    kLit,    ///< nothing blocks its rays
    kDark,   ///< one triangle blocks all of them
    kListed, ///< what may block them is listed
    kOpen,   ///< not known: rays are to be searched for
};

/// What is known of a beam.
struct Beam {
    BeamKind kind = BeamKind::kOpen;
    uint32_t count = 0;             ///< of leaves
    const uint32_t* leaf = nullptr; ///< of the hierarchy; valid until the next begin or forget
    const uint8_t* mask = nullptr;  ///< by leaf, a bit for each triangle that may block
};

/// What was asked of a cache, counted by each thread for itself.
struct BeamTally {
    static constexpr uint32_t kClasses = 8;

    uint64_t openCount = 0; ///< rays that beams left open
    uint64_t pairCount = 0; ///< rays that beams answered
    /// Beams that were asked for and do not exist, by the rays that they would serve: 1, 2, ...
    /// kClasses or more.
    uint32_t missing[kClasses] = {};
};

/// What a cache did in a frame.
struct BeamCounts {
    uint64_t madeCount = 0;  ///< beams that are kept
    uint64_t askedCount = 0; ///< rays of lights that can have beams: of no sun, of none far away
    uint64_t pairCount = 0;  ///< rays that beams answered
};

/// Keeps beams, in memory up to a limit. Between begin and the next one threads may ask at once;
/// which beams a frame makes may depend on their order, no answer does.
class BeamCache {
public:
    struct Cell;
    /// Leaves that a list holds; beams with more are open. A leaf takes about as long as tracing
    /// three rays, and a list serves about 16.
    static constexpr uint32_t kMaxLeaves = 16;
    static constexpr uint64_t kMakeAll = ~uint64_t(0);
    static constexpr uint64_t kLeastBytes = uint64_t(1) << 20;

    explicit BeamCache(StreamIsa isa = bestStreamIsa());
    ~BeamCache();
    BeamCache(const BeamCache&) = delete;
    BeamCache& operator=(const BeamCache&) = delete;

    /// Starts a frame, and forgets what does not hold any more: all where the hierarchy, its
    /// origin or `maxBytes` is another (not its diagonal, which objects change that move); beams of
    /// lights that moved. Where memory is short, cells go that the last frame did not ask for;
    /// twice the memory may then be taken for a moment. Throws Error kResource where there is no
    /// memory.
    /// @param bvh,geometry outlive what is asked until the next begin @param lights of the world
    /// @param maxBytes at least kLeastBytes
    /// @param mostMade how many beams the frame may make, those of many rays first, as far as the
    /// last frame tells; kMakeAll: all that are asked for. None while the memory is full
    void begin(const TriangleBvhView& bvh, const TruthGeometry& geometry, View<const Light> lights,
               uint64_t maxBytes, uint64_t mostMade);
    /// Says that a frame does not ask, so that the next one does not share out by what was missing
    /// before.
    void skip() { isMissingKnown_ = false; }
    /// Until the next begin, makes no beams and counts nothing: what was asked is asked again.
    void freeze();
    /// Forgets all beams and frees their memory.
    void forget();

    /// Returns the cell of a key, whose beams hold for all of `starts` on `receivers`; null: there
    /// is none, and no room or the frame may make no more beams. Valid until the next begin.
    /// @param key of a cell of surface @param starts local space @param size its side, above 0:
    /// boxes are rounded to parts of it
    Cell* cellOf(uint64_t key, const Box& starts, const BeamPlanes& receivers, float size);
    /// Returns the cell of a key, whatever it holds for; null: there is none.
    Cell* peek(uint64_t key) const;
    /// Returns whether the beams of a cell list so much that cells of half its size should be asked
    /// instead.
    bool isSplit(Cell& cell) const;
    /// Bring what cellOf will read nearer to the processor: first the one, later the other.
    void prefetchSlot(uint64_t key) const;
    void prefetchCell(uint64_t key) const;
    /// Returns the beam of a cell and a light; makes it if there is none and the frame may. Open
    /// where the light moved since the last frame, or where there is no room.
    /// @param lightLocal place of that light, local space
    /// @param tally receives its pairCount and missing; openCount is the caller's
    /// @param cell null: its beam is open @param lightIndex of begin's lights
    /// @param rayCount that it will answer, at least 1
    Beam find(Cell* cell, uint32_t lightIndex, const glm::vec3& lightLocal, uint32_t rayCount,
              BeamTally& tally);
    /// Brings what find will read nearer.
    void prefetch(const Cell& cell, uint32_t lightIndex) const;

    /// Adds what a thread counted. Called by threads at once.
    void add(const BeamTally& tally);
    /// Returns what was done since the last begin.
    BeamCounts counts() const { return {madeCount_, askedCount_, pairCount_}; }
    /// Returns the memory that beams take.
    uint64_t bytes() const { return used_; }

private:
    struct Entry;
    struct Row;

    void touch(Cell& cell) const;
    bool isShort() const;
    void splitBudget(uint64_t mostMade);
    void stopMaking();
    void* allocate(size_t bytes);
    Cell* makeCell(const Box& box, const BeamPlanes& receivers);
    Row* makeRow(size_t capacity);
    bool isCurrent(const Entry& entry) const;
    size_t slotOf(uint64_t key) const;
    /// Copies what is current. @param memory of its lists, which are copied too; null: this one
    void copyEntries(const Row& from, Row& to, const uint8_t* memory);
    uint32_t withoutThoseBelow(const Cell& cell, uint32_t* leaf, uint8_t* mask,
                               uint32_t count) const;
    Beam make(Cell& cell, uint32_t lightIndex, const glm::vec3& lightLocal);
    bool insert(Cell& cell, uint32_t lightIndex, BeamKind kind, uint32_t count, uint32_t first);
    Beam beamOf(BeamKind kind, uint32_t count, uint32_t first) const;
    void compact();

    StreamIsa isa_;
    TriangleBvhView bvh_;
    TruthGeometry geometry_;
    std::vector<Light> lights_;
    /// By light: a number that no other light or place had, and whether it stood still.
    std::vector<uint32_t> lightIds_;
    std::vector<uint8_t> isStill_;
    uint32_t nextLightId_ = 1;
    uint32_t frame_ = 0, nextCompaction_ = 0;

    uint32_t manyRays_ = 1; ///< that a beam must serve to come first in this frame
    std::atomic<int64_t> mayMakeMany_{0}, mayMakeOthers_{0}; ///< beams
    std::atomic<uint64_t> madeCount_{0}, askedCount_{0}, pairCount_{0};
    std::atomic<uint64_t> missing_[BeamTally::kClasses]; ///< as in BeamTally
    bool isMissingKnown_ = false;                        ///< missing_ is of the last frame
    bool isFrozen_ = false;
    std::atomic<bool> isFull_{false}; ///< something found no room

    uint64_t maxBytes_ = 0;
    std::unique_ptr<uint8_t, void (*)(void*)> memory_; ///< cells, rows and lists, one after another
    std::atomic<uint64_t> used_{0};
    std::vector<std::atomic<Cell*>> slots_; ///< by key; a power of two
    std::atomic<size_t> cellCount_{0};
};

} // namespace shadowdag
