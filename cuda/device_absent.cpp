// SPDX-License-Identifier: Apache-2.0
// The device functions of a program that was built without CUDA.
#include "cuda/device.h"

#include "cuda/backend.h"

namespace shadowdag::device {

bool isPresent(std::string& why) {
    why =
        "this program was built without CUDA; configure with -DSDAG_CUDA=ON on a machine with the "
        "CUDA toolkit, or use --backend cpu";
    return false;
}

std::string name() {
    throwBuiltWithoutCuda();
}
std::string driverVersion() {
    throwBuiltWithoutCuda();
}

void* allocate(size_t, const std::string&) {
    throwBuiltWithoutCuda();
}
size_t availableBytes() {
    throwBuiltWithoutCuda();
}
void release(void*) noexcept {}
void upload(void*, const void*, size_t) {
    throwBuiltWithoutCuda();
}
void copyWithin(void*, const void*, size_t) {
    throwBuiltWithoutCuda();
}
void download(void*, const void*, size_t) {
    throwBuiltWithoutCuda();
}
void* allocatePinned(size_t) {
    throwBuiltWithoutCuda();
}
void releasePinned(void*) noexcept {}
void downloadLater(void*, const void*, size_t) {
    throwBuiltWithoutCuda();
}
void* recordMark() {
    throwBuiltWithoutCuda();
}
void waitForMark(void*) {
    throwBuiltWithoutCuda();
}
double msBetween(void*, void*) {
    throwBuiltWithoutCuda();
}
void releaseMark(void*) noexcept {}
void fill(void*, int, size_t) {
    throwBuiltWithoutCuda();
}
void synchronize() {
    throwBuiltWithoutCuda();
}

} // namespace shadowdag::device
