// SPDX-License-Identifier: Apache-2.0
// Which item an invocation has: groups stand along x, and go on along y (GlProgram::dispatch).
// Include it after the group's size.

uint groupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

uint itemIndex() { return groupIndex() * gl_WorkGroupSize.x + gl_LocalInvocationID.x; }
