// Every groom and mesh that ships in data/ bakes, or is refused with a message that names it.
#include "tests/data_dir.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/wait.h>
#include <vector>

namespace fs = std::filesystem;
using keratin::test::TemporaryFolder;

namespace {

const std::string kData = KERATIN_DATA_DIR;

std::string text_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

struct Ran {
    int code;
    std::string message;
};

Ran bake(const TemporaryFolder& folder, const std::string& recipe) {
    const std::string asset = folder.file("asset.kera"), err = folder.file("err");
    fs::remove(asset);
    const std::string command =
        std::string(KERATIN_BAKE) + " '" + recipe + "' -o '" + asset + "' --quiet 2>'" + err + "'";
    const int status = std::system(command.c_str());
    REQUIRE(WIFEXITED(status));
    const Ran ran{WEXITSTATUS(status), text_of(err)};
    // All or nothing.
    CHECK(fs::exists(asset) == (ran.code == 0));
    return ran;
}

std::vector<std::string> files_of(const std::string& folder,
                                  const std::vector<std::string>& endings) {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (std::find(endings.begin(), endings.end(), entry.path().extension()) != endings.end())
            found.push_back(entry.path().string());
    std::sort(found.begin(), found.end());
    return found;
}

// OBJ files hold curves or a mesh; those with faces are meshes.
bool has_faces(const std::string& path) { return text_of(path).find("\nf ") != std::string::npos; }

}  // namespace

TEST_CASE("every groom in data bakes, or is refused with a message that names it") {
    const TemporaryFolder folder;
    std::size_t grooms = 0, malformed = 0;
    for (const std::string& file :
         files_of(kData, {".abc", ".data", ".glb", ".hair", ".igs", ".obj", ".tfx"})) {
        if (file.ends_with(".obj") && has_faces(file)) continue;
#ifndef KERATIN_WITH_OCCT
        if (file.ends_with(".igs")) continue;
#endif
        INFO(file);
        const std::string recipe =
            folder.write("recipe.json", "{ \"curves\": [ { \"file\": \"" + file + "\" } ] }");
        const Ran ran = bake(folder, recipe);
        INFO(ran.message);
        if (file.find("alembic_malformed") != std::string::npos) {
            ++malformed;
            if (ran.code == 0) continue;
            CHECK(ran.code == 2);
            CHECK(ran.message.starts_with("keratin-bake: " + file + ": "));
            CHECK(std::count(ran.message.begin(), ran.message.end(), '\n') == 1);
        } else {
            ++grooms;
            CHECK(ran.code == 0);
            CHECK(ran.message.empty());
        }
    }
    CHECK(malformed == 44);
    CHECK(grooms >= 14);
}

TEST_CASE("every mesh in data carries hair") {
    const TemporaryFolder folder;
    std::size_t meshes = 0;
    for (const std::string& file : files_of(kData, {".obj"})) {
        if (!has_faces(file)) continue;
        ++meshes;
        INFO(file);
        const std::string recipe = folder.write(
            "recipe.json",
            "{ \"points_per_strand\": 4, \"attach\": \"triangle\", \"mesh\": { \"file\": \"" +
                file + "\" },\n  \"curves\": [ { \"file\": \"" + kData +
                "/ponytail_formats/ponytail_tail.hair\" } ] }");
        const Ran ran = bake(folder, recipe);
        INFO(ran.message);
        CHECK(ran.code == 0);
    }
    CHECK(meshes >= 8);
}

TEST_CASE("every recipe in data bakes") {
    const TemporaryFolder folder;
    std::size_t recipes = 0;
    for (const std::string& file : files_of(kData, {".json"})) {
        if (text_of(file).find("\"curves\"") == std::string::npos) continue;
        ++recipes;
        INFO(file);
        const Ran ran = bake(folder, file);
        INFO(ran.message);
        CHECK(ran.code == 0);
    }
    CHECK(recipes >= 6);
}
