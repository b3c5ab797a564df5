// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/journal.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tools/workspace/image_io.h"

#include <gtest/gtest.h>

namespace shadowdag {

TEST(Journal, ResumeReusesFinishedParts) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    {
        Journal journal(path, "key", false);
        journal.set("a", {{"x", 1.5}});
    }
    const Journal resumed(path, "key", true);
    EXPECT_EQ(resumed.takenUpCount(), 1u);
    ASSERT_NE(resumed.find("a"), nullptr);
    EXPECT_EQ((*resumed.find("a"))["x"], 1.5);
    EXPECT_EQ(resumed.find("b"), nullptr);
    EXPECT_EQ(Journal(path, "key", false).find("a"), nullptr);
}

TEST(Journal, AnotherComparesJournalIsRefused) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    Journal(path, "key", false).set("a", 1);
    try {
        Journal(path, "other", true);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(error.what()).find("the key was \"key\" and is \"other\""),
                  std::string::npos)
            << error.what();
    }
    EXPECT_EQ(differenceText({{"a", 1}, {"b", {{"c", 2}}}}, {{"a", 1}, {"b", {{"c", 3}}}}),
              "b.c was 2 and is 3");
    EXPECT_EQ(differenceText({{"a", 1}}, {{"a", 1}, {"b", "x"}}), "b was nothing and is \"x\"");
    EXPECT_EQ(differenceText({{"a", 1}, {"b", 2}, {"c", 3}}, {{"a", 1}, {"b", 3}, {"d", 4}}),
              "b was 2 and is 3; c was 3 and is nothing; d was nothing and is 4");
    Json before = Json::object(), now = Json::object();
    for (const char name : std::string("abcdefghij")) {
        before[std::string(1, name)] = 1;
        now[std::string(1, name)] = 2;
    }
    EXPECT_TRUE(differenceText(before, now).ends_with("h was 1 and is 2; and 2 more"));
    EXPECT_EQ(differenceText({{"a", 1}, {"b", Json()}}, {{"a", 1}}), "");
    for (const char* text : {"", "[]", "{\"key\": \"key\"}", "{\"key\": \"key\", \"parts\": 3}"}) {
        writeText(path, text);
        try {
            Journal(path, "key", true);
            ADD_FAILURE() << "accepted: " << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
        }
    }
}

TEST(Journal, EditedPartsAreRefused) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    Journal(path, "key", false).set("a", {{"x", 1.5}});
    const std::string whole = readText(path);
    EXPECT_EQ(Journal(path, "key", true).takenUpCount(), 1u);
    for (const auto& [before, after] :
         {std::pair{"1.5", "1.6"}, {"{\"x\":1.5}", "[1.5]"}, {"parts_hash", "other_hash"}}) {
        std::string edited = whole;
        edited.replace(edited.find(before), std::string_view(before).size(), after);
        writeText(path, edited);
        try {
            Journal(path, "key", true);
            ADD_FAILURE() << "accepted: " << edited;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_NE(std::string(error.what()).find("j.json: its parts were damaged or edited"),
                      std::string::npos)
                << error.what();
        }
    }
}

TEST(Journal, PartsWithoutTheirPicturesAreMeasuredAgain) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    std::filesystem::create_directory(directory / "images");
    for (const char* name : {"images/a.png", "images/b.png"})
        writePng(directory / name, 1, 1, {glm::vec3(1)});
    {
        Journal journal(path, "key", false);
        journal.set("compare", {{"run", {{"images", {{"color", "images/a.png"}}}}}});
        journal.set("study", {{"rows", {{{"image", "b.png"}}}}});
        journal.set("none", {{"x", "png"}});
    }
    EXPECT_EQ(remarkOn(Journal(path, "key", true)), "3 finished parts are reused");
    std::filesystem::remove(directory / "images/b.png");
    {
        const Journal journal(path, "key", true);
        EXPECT_EQ(remarkOn(journal),
                  "2 finished parts are reused; 1 lost its pictures and is measured again");
        EXPECT_EQ(journal.find("study"), nullptr);
        EXPECT_NE(journal.find("compare"), nullptr);
    }
    const std::string whole = readText(directory / "images/a.png");
    for (const std::string& cut : {std::string(), whole.substr(0, whole.size() - 1)}) {
        writeText(directory / "images/a.png", cut);
        EXPECT_EQ(Journal(path, "key", true).lostCount(), 2u);
    }
    writeText(directory / "images/a.png", whole);
    EXPECT_EQ(Journal(path, "key", true).lostCount(), 1u);
    std::filesystem::remove_all(directory / "images");
    const Journal journal(path, "key", true);
    EXPECT_EQ(journal.find("compare"), nullptr);
    EXPECT_EQ(remarkOn(journal),
              "1 finished part is reused; 2 lost their pictures and are measured again");
    Journal(path, "key", false).set("study", {{"image", "b.png"}});
    EXPECT_EQ(remarkOn(Journal(path, "key", true)),
              "1 finished part lost its pictures and is measured again");
}

TEST(InputHashes, DependOnEveryByteThatResultsDependOn) {
    const TemporaryDirectory directory;
    const std::string gltf = directory / "a.gltf", bin = directory / "a b.bin",
                      costs = directory / "costs.json";
    writeText(gltf, R"({"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,x"}], "images": [{}]})");
    writeText(bin, "1");
    writeText(costs, "2");
    const auto hashes = [&] { return inputHashes({gltf, "builtin:atrium"}, {costs}); };
    const Json first = hashes();
    EXPECT_EQ(hashes(), first);
    EXPECT_EQ(first["program"].get<std::string>().size(), 32u);
    EXPECT_EQ(first.size(), 5u) << first;
    for (const std::string& path : {gltf, bin, costs}) {
        const std::string old = readText(path);
        writeText(path, old + " ");
        EXPECT_NE(hashes(), first) << path;
        writeText(path, old);
    }
    EXPECT_EQ(inputHashes({}, {directory / "none"})[directory / "none"], "missing");
    const std::string obj = directory / "a.obj", mtl = directory / "a b.mtl";
    writeText(obj, "v 0 0 0\n mtllib a b.mtl \r\nmtllib\n");
    writeText(mtl, "newmtl m\nmap_Kd a b.png\nmap_d -clamp on c.png\n");
    const Json named = inputHashes({obj}, {});
    for (const char* image : {"a b.png", "c.png"})
        EXPECT_EQ(named[directory / image], "missing");
    writeText(mtl, "newmtl n\n");
    EXPECT_NE(inputHashes({obj}, {})[mtl], named[mtl]);
}

// Images are sought in the scene's folder, by their last part where the path is not there, and the
// library STEM.mtl where the named one is missing.
TEST(InputHashes, DependOnFilesThatAreReadInPlaceOfThoseNamed) {
    const TemporaryDirectory directory;
    const std::string obj = directory / "a.obj";
    for (const auto& [objText, mtl, image] : {std::tuple{"mtllib none.mtl\n", "a.mtl", "b.png"},
                                              {"mtllib sub\\b.mtl\n", "sub/b.mtl", "b.png"},
                                              {"mtllib b.mtl\n", "b.mtl", "textures/b.png"},
                                              {"mtllib b.mtl\n", "b.mtl", "c d.png"}}) {
        const std::string library = directory / mtl, texture = directory / image;
        for (const std::string& path : {library, texture})
            std::filesystem::create_directories(std::filesystem::path(path).parent_path());
        writeText(obj, objText);
        writeText(library, "newmtl m\nmap_Kd C:\\lost\\b.png\nmap_Kd textures\\b.png\n"
                           "map_d -s 1 1 1 c d.png\n");
        writeText(texture, "1");
        const Json first = inputHashes({obj}, {});
        for (const std::string& path : {library, texture}) {
            const std::string old = readText(path);
            writeText(path, old + " ");
            EXPECT_NE(inputHashes({obj}, {}), first) << path;
            writeText(path, old);
        }
        for (const std::string& path : {library, texture})
            std::filesystem::remove(path);
    }
}

} // namespace shadowdag
