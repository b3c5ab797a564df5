// SPDX-License-Identifier: Apache-2.0
// Shows a frame from another camera than its own: the samples that the frozen camera saw, and its
// clusters as boxes.
#pragma once

#include "hybrid/clusters/clusters.h"
#include "hybrid/gbuffer/view_rays.h"
#include "scenes/camera.h"

#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace shadowdag {

/// Returns a world point in a camera's picture: x and y in pixels, 0 at the centre of the first,
/// and z in metres along the forward axis; x and y are meaningless if z <= 0.
glm::dvec3 pixelOfPoint(const ViewRays& view, const glm::dvec3& pointWorld);

/// Returns the ends of a world segment in a camera's picture, as pixelOfPoint, cut at the near
/// plane; nothing if all of it is before that.
std::optional<std::pair<glm::dvec3, glm::dvec3>> pixelsOfSegment(const ViewRays& view, glm::dvec3 a,
                                                                 glm::dvec3 b);

/// Returns the edges of a box.
std::array<std::pair<glm::dvec3, glm::dvec3>, 12> edgesOf(const Box& box);

/// Returns the observer's display picture: samples that the frozen camera saw have its picture's
/// colour, others are grey by how they face the observer; boxes of clusters and the frozen camera's
/// frustum are drawn as lines over them, hidden or not.
/// @param observed,observer the samples that the observer sees, and its camera
/// @param frozen,frozenCamera,frozenDisplay the frame; its G-buffer and its picture, same size
/// @param boxesWorld the clusters' boxes; empty: none are drawn
std::vector<glm::vec3> drawObserved(const GBufferView& observed, const Camera& observer,
                                    const GBufferView& frozen, const Camera& frozenCamera,
                                    const std::vector<glm::vec3>& frozenDisplay,
                                    View<const Box> boxesWorld);

} // namespace shadowdag
