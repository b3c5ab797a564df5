// SPDX-License-Identifier: Apache-2.0
// Triangles and batches of the host, made available to passes.
#pragma once

#include "cuda/resident.h"
#include "scenes/batches.h"

#include <string>

namespace shadowdag {

/// Copies of what a TriangleView and a BatchView show, on one backend; on the CPU the arrays
/// themselves, which outlive this in place. Hierarchy and levels of detail included.
class ResidentGeometry {
public:
    /// @param name prefix of the names in the ledger
    ResidentGeometry(Backend backend, const std::string& name);

    /// Makes all of it available.
    void set(const TriangleView& triangles, const BatchView& batches);
    /// The same if only positions changed since set(), and of these only those of the ranges,
    /// which ascend. @param movedBatches what that changed of the batches and their hierarchy
    void setMoved(const TriangleView& triangles, const BatchView& batches,
                  const std::vector<ArrayRange>& movedPositions,
                  const MovedBatchRanges& movedBatches);

    TriangleView triangles() const;
    /// Returns `host`, which set() was given last, on the backend.
    BatchView batches(const BatchView& host) const;

private:
    void setLevels(const BatchView& batches);

    Backend backend_;
    Resident<glm::vec3> positions_;
    Resident<glm::uvec3> triangles_;
    Resident<uint32_t> triangleCut_;
    Resident<CutTriangle> cuts_;
    Resident<MaskInfo> masks_;
    Resident<uint32_t> maskWords_;
    Resident<Batch> batches_;
    Resident<Box> boxes_;
    Resident<uint32_t> batchTriangles_;
    Resident<Box> bvhBoxes_;
    Resident<uint32_t> bvhItems_;
    Resident<Box> partBoxes_;
    Resident<float> levelErrors_;
};

} // namespace shadowdag
