// SPDX-License-Identifier: Apache-2.0
// Which item an invocation has: groups stand along x, and go on along y (GlProgram::dispatch), from
// firstGroup on.
// Include it after the group's size.

uniform uint firstGroup;

uint groupIndex() { return firstGroup + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

uint itemIndex() { return groupIndex() * gl_WorkGroupSize.x + gl_LocalInvocationID.x; }
