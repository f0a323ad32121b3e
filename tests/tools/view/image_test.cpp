#include "tools/keratin-view/image.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

using namespace keratin;
using namespace keratin::view;

namespace {

// A folder of this process that goes when the test ends.
struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("keratin_image_" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
};

}  // namespace

TEST_CASE("a picture written as PNG is read back the same") {
    const Folder folder;
    Image image = make_image(13, 7, {1, 2, 3});
    for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = std::uint8_t(i * 37);
    const std::string path = folder.file("round.png");
    REQUIRE(write_png(image, path));
    const auto again = read_image(path);
    REQUIRE(again);
    CHECK(again->width == 13);
    CHECK(again->rgb == image.rgb);
}

TEST_CASE("a picture that cannot be read or written is an error that names it") {
    const Folder folder;
    const auto missing = read_image(folder.file("missing.png"));
    REQUIRE_FALSE(missing);
    CHECK(to_string(missing.error()).find("missing.png") != std::string::npos);
    std::ofstream(folder.file("text.png")) << "no picture";
    const auto text = read_image(folder.file("text.png"));
    REQUIRE_FALSE(text);
    CHECK(text.error().code == ErrorCode::input);
    const auto nowhere = write_png(make_image(2, 2, {0, 0, 0}), folder.file("no_folder/a.png"));
    REQUIRE_FALSE(nowhere);
    CHECK(exit_code(nowhere.error()) == 2);
}

TEST_CASE("sRGB there and back is the same byte") {
    for (int v = 0; v < 256; ++v) CHECK(to_srgb(from_srgb(std::uint8_t(v))) == v);
}

TEST_CASE("a contact sheet shows every picture once") {
    std::vector<Image> pictures;
    for (int i = 0; i < 5; ++i)
        pictures.push_back(make_image(40, 30, {std::uint8_t(50 * i), 200, 10}));
    const Image sheet = contact_sheet(pictures);
    CHECK(sheet.width <= 4 * 44 + 4);
    for (int i = 0; i < 5; ++i) {
        int found = 0;
        for (int y = 0; y < sheet.height; ++y)
            for (int x = 0; x < sheet.width; ++x) found += sheet.at(x, y) == pictures[i].at(0, 0);
        CHECK(found == 40 * 30);
    }
}

TEST_CASE("a contact sheet has the columns asked for, but none empty") {
    const std::vector<Image> pictures(5, make_image(40, 30, {90, 120, 150}));
    CHECK(contact_sheet(pictures, 3).width == 3 * 44 + 4);
    CHECK(contact_sheet(pictures, 3).height == 2 * 34 + 4);
    CHECK(contact_sheet(pictures, 9).width == 5 * 44 + 4);
    CHECK(contact_sheet(pictures, 9).height == 34 + 4);
}

TEST_CASE("a contact sheet of many pictures shrinks to the side allowed") {
    const std::vector<Image> pictures(9, make_image(100, 100, {90, 120, 150}));
    const Image sheet = contact_sheet(pictures, 0, 150);
    CHECK(sheet.width <= 150 + 4 * 4);
    CHECK(sheet.at(sheet.width / 2, sheet.height / 2) == std::array<std::uint8_t, 3>{90, 120, 150});
}

TEST_CASE("text leaves marks and stays inside the picture") {
    Image image = make_image(60, 12, {0, 0, 0});
    draw_text("frame 30", 2, 2, 1, {255, 255, 255}, image);
    CHECK(std::count(image.rgb.begin(), image.rgb.end(), 255) > 60);
    Image tiny = make_image(3, 3, {0, 0, 0});
    draw_text("a long text", -5, -2, 3, {255, 255, 255}, tiny);
    CHECK(tiny.rgb.size() == 27);
}
