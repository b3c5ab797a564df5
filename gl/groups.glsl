// SPDX-License-Identifier: Apache-2.0
// The index of an invocation's work item. Groups are numbered from firstGroup, along x first, then
// along y (GlProgram::dispatch). Include this file after the declaration of the group's size.

uniform uint firstGroup;

uint groupIndex() { return firstGroup + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

uint itemIndex() { return groupIndex() * gl_WorkGroupSize.x + gl_LocalInvocationID.x; }
