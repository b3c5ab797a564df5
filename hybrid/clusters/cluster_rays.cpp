// SPDX-License-Identifier: Apache-2.0
#include "hybrid/clusters/cluster_rays.h"

#include "cuda/mutant.h"
#include "voxel/dag_stream.h"

namespace shadowdag {

static_assert(ReceiverGroups::kTileSide == kTileSize);

void setReceivers(const GBufferView& gbuffer, View<const uint32_t> samples, const RayInputs& rays,
                  ReceiverGroups& receivers) {
    if (rays.options.believesNone())
        receivers.reset();
    else
        receivers.reset(rays.dag.grid, rays.options.offset);
    for (const uint32_t s : samples)
        receivers.add(gbuffer.positionWorld[s], gbuffer.normalWorld[s],
                      s % gbuffer.width % kTileSize, s / gbuffer.width % kTileSize);
    receivers.build();
}

void markPairs(const GBufferView& gbuffer, View<const uint32_t> samples, const Light& light,
               std::vector<uint8_t>& isAsked) {
    isAsked.resize(samples.count);
    for (size_t i = 0; i < samples.count; ++i)
        isAsked[i] =
            isPair(light, gbuffer.positionWorld[samples[i]], gbuffer.normalWorld[samples[i]]);
}

bool ClusterRays::canStream(const RayOptions& options) {
    return options.believesNone() || !options.usesLevels();
}

void ClusterRays::setCluster(View<const uint32_t> samples) {
    samples_ = samples;
    isPrepared_ = false;
    movers_.reset();
    starts_.clear();
    positions_.clear();
    normals_.clear();
    if (!beams_ || samples.empty())
        return;
    beams_->setCluster(gbuffer_.positionWorld, gbuffer_.normalWorld, samples,
                       pixelFootprintWorld(rays_.detail, gbuffer_.positionWorld[samples[0]]),
                       sorted_);
    samples_ = viewOf(sorted_);
}

void ClusterRays::prepare() {
    if (!isPrepared_)
        setReceivers(gbuffer_, samples_, rays_, receivers_);
    isPrepared_ = true;
}

RayCounts ClusterRays::answer(uint32_t lightIndex, const Light& light, View<const uint8_t> isAsked,
                              View<uint8_t> isDark) {
    RayCounts counts;
    if (beams_ && light.kind != Light::kSun) {
        traceBeams(lightIndex, light, isAsked, isDark);
        for (size_t i = 0; i < isAsked.count; ++i)
            counts.exactCount += isAsked[i];
    } else {
        prepare();
        receivers_.listAsked(isAsked, asked_);
        for (const uint32_t i : asked_)
            isDark[i] = 0;
        if (!rays_.options.believesNone())
            traceVoxels(lightIndex, light, isDark);
        if (!rays_.options.believesAll()) {
            traced_.clear();
            for (const uint32_t i : asked_)
                if (!isDark[i])
                    traced_.push_back(i);
            counts.exactCount = traceTriangles(light, isDark);
        }
    }
    if (rays_.movers.mayShadow(lightIndex))
        counts.moverTestCount = askMovers(lightIndex, light, isAsked, isDark);
    return counts;
}

void ClusterRays::traceBeams(uint32_t lightIndex, const Light& light, View<const uint8_t> isAsked,
                             View<uint8_t> isDark) {
    if (starts_.empty())
        makeStarts(false);
    if (!beams_->hasStarts())
        beams_->setStarts(viewOf(starts_));
    if (beams_->answer(lightIndex, light, isAsked.data, isDark) == 0)
        return;
    isOpen_.resize(samples_.count);
    beams_->listOpen(viewOf(isOpen_));
    prepare();
    receivers_.listAsked(viewOf(isOpen_), traced_);
    traceTriangles(light, isDark);
}

void ClusterRays::traceVoxels(uint32_t lightIndex, const Light& light, View<uint8_t> isDark) {
    const RayOptions& options = rays_.options;
    segments_.resize(asked_.size());
    if (light.kind == Light::kSun) // every ray has an end of its own
        for (size_t i = 0; i < asked_.size(); ++i)
            segments_[i] = pairSegment(rays_, pairOf(asked_[i], lightIndex, light)).segment;
    else
        receivers_.starts().segments(light.positionWorld, viewOf(asked_), segments_.data());
    traced_ = asked_;
    if (!options.believesAll()) {
        size_t count = 0;
        for (size_t i = 0; i < asked_.size(); ++i) {
            DagSegment segment = segments_[i];
            if (!shortenToBelieved(rays_, pairOf(asked_[i], lightIndex, light), segment))
                continue;
            traced_[count] = asked_[i];
            segments_[count++] = segment;
        }
        traced_.resize(count);
        segments_.resize(count);
    }
    blocked_.resize(traced_.size());
    traceStream(rays_.dag, viewOf(segments_), viewOf(blocked_));
    for (size_t i = 31; i < traced_.size() && isMutant(Mutant::kRayLaneLost); i += 32)
        blocked_[i] = 0;
    for (size_t i = 0; i < traced_.size(); ++i)
        isDark[traced_[i]] = blocked_[i];
}

void ClusterRays::makeStarts(bool withNormals) {
    TruthStarts starts(rays_.exact.geometry);
    for (const uint32_t s : samples_) {
        positions_.push_back(gbuffer_.positionWorld[s]);
        if (withNormals)
            normals_.push_back(gbuffer_.normalWorld[s]);
        else
            starts_.push_back(
                starts.make(gbuffer_.positionWorld[s],
                            mutated(Mutant::kExactNormalFlipped, gbuffer_.normalWorld[s],
                                    -gbuffer_.normalWorld[s]),
                            gbuffer_.triangle[s]));
    }
}

uint32_t ClusterRays::traceTriangles(const Light& light, View<uint8_t> isDark) {
    const bool byEmbree = rays_.options.triangleRays == TriangleRays::kEmbree;
    if (positions_.empty())
        makeStarts(byEmbree);
    blocked_.resize(traced_.size());
    if (byEmbree)
        rays_.embree->trace(light, viewOf(positions_), viewOf(normals_), viewOf(traced_),
                            viewOf(blocked_));
    else
        exact_.trace(light, viewOf(starts_), viewOf(positions_), viewOf(traced_), viewOf(blocked_));
    for (size_t i = 0; i < traced_.size(); ++i)
        isDark[traced_[i]] = blocked_[i];
    return uint32_t(traced_.size());
}

ShadowPair ClusterRays::pairOf(uint32_t i, uint32_t lightIndex, const Light& light) const {
    const uint32_t s = samples_[i];
    const glm::vec3& position = gbuffer_.positionWorld[s];
    return {
        position,   gbuffer_.normalWorld[s],  pointAtLight(light, position), gbuffer_.triangle[s],
        lightIndex, light.kind == Light::kSun};
}

uint32_t ClusterRays::askMovers(uint32_t lightIndex, const Light& light,
                                View<const uint8_t> isAsked, View<uint8_t> isDark) {
    if (light.kind != Light::kSun)
        return movers_.answer(rays_.movers, gbuffer_, samples_, light.positionWorld, isAsked,
                              isDark);
    uint32_t count = 0;
    for (const uint32_t i : asked_)
        if (!isDark[i]) {
            ++count;
            isDark[i] = isDarkByMovers(rays_.movers, pairOf(i, lightIndex, light));
        }
    return count;
}

} // namespace shadowdag
