// SPDX-License-Identifier: Apache-2.0
// Files of arrays: what is written is read, by us and by numpy; every truncation and flipped bit is
// refused, with file and offset.
#include "tools/workspace/array_file.h"

#include "cuda/error.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/workspace/complaint.h"
#include "tools/workspace/whole_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace shadowdag {
namespace {

using test::complaintOf;
using testing::HasSubstr;

constexpr std::string_view kKind = "SDAGTEST";

std::vector<NamedArray> madeArrays() {
    const float points[] = {1, 2, 3, 4, 5, 6};
    const uint32_t indices[] = {7, 8, 9};
    const double times[] = {0.5};
    const uint64_t wide[] = {uint64_t(1) << 40, 2};
    const std::string text = "{\"scene\": \"a\"}";
    return {makeArray("point", ArrayType::kFloat, points, 2, 3),
            makeArray("index", ArrayType::kUint32, indices, 3),
            makeArray("time_ms", ArrayType::kDouble, times, 1),
            makeArray("wide", ArrayType::kUint64, wide, 2),
            makeArray("nothing", ArrayType::kUint32, indices, 0),
            makeArray("about", ArrayType::kUint8, text.data(), text.size())};
}

void expectSame(const std::vector<NamedArray>& a, const std::vector<NamedArray>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].name, b[i].name);
        EXPECT_EQ(a[i].type, b[i].type) << a[i].name;
        EXPECT_EQ(a[i].columns, b[i].columns) << a[i].name;
        EXPECT_EQ(a[i].rows, b[i].rows) << a[i].name;
        EXPECT_EQ(a[i].bytes, b[i].bytes) << a[i].name;
    }
}

TEST(ArrayFile, WhatIsWrittenIsRead) {
    expectSame(decodeArrays(kKind, encodeArrays(kKind, madeArrays()), "f"), madeArrays());
    expectSame(decodeNpz(encodeNpz(madeArrays()), "f"), madeArrays());
    expectSame(decodeArrays(kKind, encodeArrays(kKind, {}), "f"), {});
}

TEST(ArrayFile, HasTheDocumentedLayout) {
    const std::string file = encodeArrays(kKind, madeArrays());
    EXPECT_EQ(file.substr(0, 8), kKind);
    EXPECT_EQ(file.substr(8, 8), std::string("\1\0\0\0\6\0\0\0", 8));
    EXPECT_EQ(file.substr(32, 6), std::string("point\0", 6));
    uint64_t offset = 0;
    std::memcpy(&offset, file.data() + 32 + 40, 8);
    EXPECT_EQ(offset, 448u) << "32 + 6 * 64, at a multiple of 64";
    float second = 0;
    std::memcpy(&second, file.data() + offset + 4, 4);
    EXPECT_EQ(second, 2.0f);
    EXPECT_EQ(crc32("123456789", 9), 0xcbf43926u) << "the check value of CRC-32";
    EXPECT_EQ(crc32("6789", 4, crc32("12345", 5)), 0xcbf43926u);
}

TEST(ArrayFile, EveryTruncationAndFlippedBitIsRefused) {
    const std::string file = encodeArrays(kKind, madeArrays());
    for (size_t size = 0; size < file.size(); ++size)
        EXPECT_THAT(complaintOf([&] { decodeArrays(kKind, file.substr(0, size), "a.rays"); }),
                    HasSubstr("a.rays: at byte "))
            << size;
    for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
        std::string damaged = file;
        damaged[bit / 8] = char(damaged[bit / 8] ^ (1 << (bit % 8)));
        EXPECT_THAT(complaintOf([&] { decodeArrays(kKind, damaged, "a.rays"); }),
                    HasSubstr("a.rays: at byte "))
            << bit;
    }
    EXPECT_THAT(complaintOf([&] { decodeArrays(kKind, file + '\0', "a.rays"); }),
                HasSubstr("at byte 16: the file has "));
    EXPECT_THAT(complaintOf([&] { decodeArrays("SDAGRAYS", file, "a.rays"); }),
                HasSubstr("a.rays: at byte 0: it does not begin with \"SDAGRAYS\""));
}

TEST(ArrayFile, EveryTruncationOfAnNpzIsRefusedAndNoFlippedBitChangesAnArray) {
    const std::string file = encodeNpz(madeArrays());
    for (size_t size = 0; size < file.size(); ++size)
        EXPECT_THAT(complaintOf([&] { decodeNpz(file.substr(0, size), "a.npz"); }),
                    HasSubstr("a.npz: at byte "))
            << size;
    for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
        std::string damaged = file;
        damaged[bit / 8] = char(damaged[bit / 8] ^ (1 << (bit % 8)));
        try {
            const std::vector<NamedArray> arrays = decodeNpz(damaged, "a.npz");
            for (const NamedArray& array : madeArrays()) // times, versions and attributes of a zip
                if (const NamedArray* found = findArray(arrays, array.name)) {
                    EXPECT_EQ(found->bytes, array.bytes) << bit;
                }
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("a.npz: at byte ")) << bit;
        }
    }
}

// Else a megabyte of entries that share their bytes would be read as a hundred.
TEST(ArrayFile, ArraysOfAnArchiveShareNoBytes) {
    std::vector<NamedArray> arrays = {madeArrays()[0], madeArrays()[0]};
    arrays[0].name = "a";
    arrays[1].name = "b";
    std::string file = encodeNpz(arrays);
    EXPECT_EQ(decodeNpz(file, "a.npz").size(), 2u);
    const std::string signature("PK\x01\x02");
    const size_t second = file.find(signature, file.find(signature) + 1);
    ASSERT_NE(second, std::string::npos);
    file.replace(second + 42, 4, std::string(4, '\0')); // where the first begins
    EXPECT_THAT(complaintOf([&] { decodeNpz(file, "a.npz"); }),
                HasSubstr("array \"b\" begins before the end of the last one"));
}

TEST(ArrayFile, NumpyReadsWhatWeWriteAndWeReadWhatItWrites) {
    const TemporaryDirectory directory;
    const std::string ours = directory / "ours.npz", theirs = directory / "theirs.npz";
    writeWholeFile(ours, encodeNpz(madeArrays()));
    std::string said;
    const std::string script =
        "import sys, numpy as np\n"
        "a = np.load(sys.argv[1])\n"
        "assert a['point'].dtype == np.float32 and a['point'].tolist() == [[1, 2, 3], [4, 5, 6]]\n"
        "assert a['index'].tolist() == [7, 8, 9] and a['wide'].tolist() == [2**40, 2]\n"
        "assert bytes(a['about']).decode() == '{\"scene\": \"a\"}' and a['nothing'].shape == (0,)\n"
        "np.savez(sys.argv[2], lit=np.array([True, False]), name='t\\u00fcr', whole=np.arange(3),\n"
        "         half=np.float32(0.5), grid=np.ones((2, 2)))\n"
        "np.savez_compressed(sys.argv[2] + '.small.npz', lit=np.zeros(9999))\n";
    ASSERT_EQ(runProgram({"/usr/bin/python3", "-c", script, ours, theirs}, &said), 0) << said;
    const std::vector<NamedArray> arrays = readArrays(kKind, theirs);
    EXPECT_EQ(requireArray(arrays, theirs, "lit", ArrayType::kUint8, 1).bytes,
              (std::vector<uint8_t>{1, 0}));
    const NamedArray& name = requireArray(arrays, theirs, "name", ArrayType::kUint8, 1);
    EXPECT_EQ(std::string(name.bytes.begin(), name.bytes.end()), "t\xc3\xbcr");
    EXPECT_EQ(requireArray(arrays, theirs, "whole", ArrayType::kDouble, 1).at<double>(2), 2.0);
    EXPECT_EQ(requireArray(arrays, theirs, "half", ArrayType::kFloat, 1).rows, 1u);
    EXPECT_EQ(requireArray(arrays, theirs, "grid", ArrayType::kDouble, 2).rows, 2u);
    EXPECT_THAT(complaintOf([&] { readArrays(kKind, theirs + ".small.npz"); }),
                HasSubstr("array \"lit\" is compressed; write it with numpy.savez"));
}

TEST(ArrayFile, MissingFilesAndArraysAreNamed) {
    EXPECT_THAT(complaintOf([] { readArrays(kKind, "nowhere.rays"); }),
                HasSubstr("nowhere.rays: "));
    EXPECT_THAT(
        complaintOf([] { requireArray(madeArrays(), "a.rays", "normal", ArrayType::kFloat, 3); }),
        HasSubstr("a.rays: has no array \"normal\""));
    EXPECT_THAT(
        complaintOf([] { requireArray(madeArrays(), "a.rays", "point", ArrayType::kFloat, 4); }),
        HasSubstr("a.rays: array \"point\" has type 4 and 3 columns; it needs type 4 and 4; "
                  "write the file again"));
}

} // namespace
} // namespace shadowdag
