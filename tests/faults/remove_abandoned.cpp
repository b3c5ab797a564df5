// SPDX-License-Identifier: Apache-2.0
// A program that removes the unfinished files of a folder, and nothing else, so that each of its
// calls of the C library can be made to fail. Exit status: 0 done, 3 memory is short.
#include "scenes/output_file.h"

#include <new>

int main(int argc, char** argv) {
    try {
        for (int i = 1; i < argc; ++i)
            shadowdag::removeAbandonedFiles(argv[i]);
        return 0;
    } catch (const std::bad_alloc&) {
        return 3;
    }
}
