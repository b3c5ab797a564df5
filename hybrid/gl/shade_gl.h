// SPDX-License-Identifier: Apache-2.0
// The shading pass in OpenGL: one compute program traces the DAG and reads the maps.
#pragma once

#include "hybrid/frame/shade.h"
#include "shadowmap/rasterize_gl.h"

namespace shadowdag {

/// Shades the input of a ShadeSamples of the CPU. The context is current in every call.
class GlShading {
public:
    /// @param pages the memory that the maps are read from @param geometry the world's; outlives it
    GlShading(GlPages pages, const GlContext& context, GlGeometry& geometry);

    /// Copies the DAG; an empty one blocks nothing.
    void setDag(const DagView& dag);

    /// Runs the program once without work, so that no frame includes the time to compile it.
    void warmUp(GlMapDrawer& maps);

    /// Runs shadeUnlit and shadeLights; depths come from `maps`, which drew them. Colours differ
    /// from those of the CPU by a few roundings.
    /// @param work views on the host, its maps without depths; counters are added to
    /// @param pairLights with a recorder: PairSet::light, on the host
    void shade(const ShadeSamples& work, GlMapDrawer& maps, View<const uint32_t> pairLights);

private:
    void bindBuffers();
    void upload(const ShadeSamples& work, View<const uint32_t> pairLights);
    void download(const ShadeSamples& work);

    const GlContext& context_;
    GlProgram program_;
    GlBuffer dag_{"gl dag words"}, samples_{"gl samples"}, lights_{"gl lights"},
        surfaces_{"gl materials"}, clusterStarts_{"gl cluster starts"},
        clusterLights_{"gl cluster lights"}, colors_{"gl colour"}, counts_{"gl shading counts"},
        pairs_{"gl pairs"}, movers_{"gl movers"};
    GlGeometry& geometry_;
    uint32_t dagRootAddress_ = kNoNode;
    VoxelGrid grid_;
};

} // namespace shadowdag
