// From curves to rods that stay where they were groomed: keratin-bake with "rod": { "sag_free":
// true }, then the rod solver over the asset.
#include "runtime/run/asset_body.h"
#include "runtime/run/solver_run.h"
#include "tests/json_schema.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <sys/wait.h>

using namespace keratin;
using measure::Point;
using nlohmann::json;

namespace {

std::string content(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Straight, bowed and curled strands from all over a ball, as an OBJ file of lines.
std::string curves(std::size_t count, double length, unsigned seed) {
    constexpr std::size_t kPoints = 24;
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    std::string vertices, lines;
    for (std::size_t s = 0; s < count; ++s) {
        const double z = uniform(-1, 1), around = uniform(0, 2 * std::numbers::pi);
        const double ring = std::sqrt(1 - z * z);
        const Point out{ring * std::cos(around), z, ring * std::sin(around)};
        const Point side{-std::sin(around), 0, std::cos(around)};
        const Point other = measure::cross(out, side);
        const double radius = s % 3 == 0 ? 0 : uniform(0.02, 0.12) * length;
        const double turns = s % 3 == 1 ? 0.25 : uniform(1, 2.5);
        lines += "l";
        for (std::size_t p = 0; p < kPoints; ++p) {
            const double f = static_cast<double>(p) / (kPoints - 1);
            const double a = 2 * std::numbers::pi * turns * f;
            const Point x = out * (0.08 + length * f) + side * (radius * (1 - std::cos(a))) +
                            other * (radius * std::sin(a));
            char text[80];
            std::snprintf(text, sizeof text, "v %.9g %.9g %.9g\n", x.x, x.y, x.z);
            vertices += text;
            lines += " " + std::to_string(kPoints * s + p + 1);
        }
        lines += "\n";
    }
    return vertices + lines;
}

struct Folder : test::TemporaryFolder {
    // Bakes a recipe with every strand a guide; gives the report.
    json bake(const std::string& asset, const std::string& fields,
              const std::string& options = "") const {
        write("r.json",
              "{ \"curves\": [{ \"file\": \"curves.obj\", \"root_end\": \"first\" }], "
              "\"guides\": { \"fraction\": 1, \"measure\": false }, "
              "\"points_per_strand\": 16" +
                  fields + " }");
        const std::string command = "cd '" + path().string() +
                                    "' && '" KERATIN_BAKE "' r.json --json " + options + " -o " +
                                    asset + " >out.txt 2>err.txt";
        const int status = std::system(command.c_str());
        INFO(content(file("err.txt")));
        REQUIRE(WEXITSTATUS(status) == 0);
        return json::parse(content(file("out.txt")));
    }
    // m, largest distance of each guide's tip from the groom within 1 s under gravity.
    std::vector<double> drift(const std::string& asset) const {
        const auto scene = parse_scene(
            "{ \"solver\": \"rod\", \"settings\": { \"contact\": "
            "\"none\" }, \"assets\": [{ \"file\": \"" +
                asset + "\" }] }",
            "s.json", path().string());
        REQUIRE(scene);
        auto run = make_rod_run(*scene, {"test", 1, false});
        if (!run) FAIL(to_string(run.error()));
        const RunLayout& layout = (*run)->layout();
        const auto& first = layout.head.guide_first_point;
        std::vector<double> out(first.size() - 1);
        constexpr double kStep = 2e-3;
        for (int k = 0; k < 500; ++k) {
            REQUIRE((*run)->step(k * kStep, (k + 1) * kStep));
            if (k % 10 != 9) continue;
            RunState state;
            (*run)->look(state);
            for (std::size_t s = 0; s < out.size(); ++s)
                out[s] = std::max(out[s], measure::distance(state.position[first[s + 1] - 1],
                                                            layout.rest[first[s + 1] - 1]));
        }
        return out;
    }
    // Strand numbers of the guides in the order of their lanes.
    std::vector<std::uint32_t> numbers(const std::string& asset) const {
        auto view = AssetView::open(file(asset));
        REQUIRE(view);
        std::vector<std::uint32_t> out;
        for (const std::uint32_t strand : view->fields().guide_strand)
            if (strand != kNoStrand) out.push_back(view->fields().strand_id[strand]);
        return out;
    }
    std::vector<float> strain(const std::string& asset) const {
        auto view = AssetView::open(file(asset));
        REQUIRE(view);
        const auto field = view->fields().guide_rod_strain;
        return {field.begin(), field.end()};
    }
};

double largest(const std::vector<double>& values) {
    return *std::max_element(values.begin(), values.end());
}

}  // namespace

TEST_CASE("rods that bear their weight stay where they were groomed, others sag by millimetres") {
    const Folder folder;
    double residual = 0, stays = 0;
    for (const double length : {0.03, 0.06})
        for (const double radius : {4e-5, 7e-5}) {
            folder.write("curves.obj", curves(30, length, 5));
            char material[80];
            std::snprintf(material, sizeof material, ", \"material\": { \"radii\": [%g, %g] }",
                          radius, length < 0.05 ? radius : 0.7 * radius);
            const json plain = folder.bake("plain.kera", material);
            const json report = folder.bake(
                "held.kera", material + std::string(", \"rod\": { \"sag_free\": true }"));
            CHECK_FALSE(plain.contains("rod_sag_free"));
            const json& rods = report["rod_sag_free"];
            REQUIRE(rods["guides"] == 30);
            REQUIRE(rods["each"].size() == 30);
            const auto sagged = folder.drift("plain.kera"), held = folder.drift("held.kera");
            const auto numbers = folder.numbers("held.kera");
            for (std::size_t g = 0; g < numbers.size(); ++g) {
                const json& guide = rods["each"][numbers[g]];
                REQUIRE(guide["strand"] == numbers[g]);
                if (!guide["held"]) continue;
                residual = std::max(residual, guide["residual"].get<double>());
                stays = std::max(stays, held[g]);
                CHECK(held[g] < 1e-6);
            }
            INFO(length << " m, " << radius << " m: " << rods["too_soft"] << " too soft, residual "
                        << residual << ", drift " << stays << " m, sag " << largest(sagged)
                        << " m");
            CHECK(rods["too_soft"].get<int>() <= (length < 0.05 ? 0 : 3));
            CHECK(rods["residual"]["p95"].get<double>() < 1e-6);
            CHECK(largest(sagged) > 1e-3);
        }
    CHECK(residual < 1e-6);
    std::printf("residual at most %.2g of the weight, drift at most %.2g m\n", residual, stays);
}

TEST_CASE("rods too soft for their groom are counted, named and said in the report") {
    const Folder folder;
    folder.write("curves.obj", curves(20, 0.25, 9));
    const json report = folder.bake("soft.kera", ", \"rod\": { \"sag_free\": true }", "--explain");
    const json& rods = report["rod_sag_free"];
    const int soft = rods["too_soft"];
    CHECK(soft > 5);
    CHECK(soft == std::count_if(rods["each"].begin(), rods["each"].end(),
                                [](const json& guide) { return !guide["held"]; }));
    std::size_t named = 0;
    for (const json& finding : report["findings"])
        if (finding["code"] == "KB026") named += finding["strand_count"].get<std::size_t>();
    CHECK(named == static_cast<std::size_t>(soft));
    CHECK(rods["settles"]["max"].get<double>() > 0.01);
    for (const json& guide : rods["each"]) {
        CHECK((guide["settles"] == 0) == guide["held"].get<bool>());
        if (guide["held"]) CHECK(guide["residual"].get<double>() < 1e-6);
    }
    const std::string schema_file = KERATIN_SCHEMA_DIR "/report/keratin-bake.schema.json";
    CHECK(test::schema_misfit(json::parse(content(schema_file)), report) == "");
    CHECK(content(folder.file("err.txt"))
              .find("sag-free rest shapes of rods: 20 guides, of which " + std::to_string(soft) +
                    " are too soft") != std::string::npos);
}

TEST_CASE("an asset with sag-free rods has the same bytes for 1, 2 and 7 threads") {
    const Folder folder;
    folder.write("curves.obj", curves(24, 0.07, 3));
    std::string first;
    for (const char* threads : {"1", "2", "7"}) {
        folder.bake("a.kera", ", \"rod\": { \"sag_free\": true }",
                    std::string("--threads ") + threads);
        const std::string bytes = content(folder.file("a.kera"));
        if (first.empty()) first = bytes;
        CHECK(bytes == first);
    }
}

TEST_CASE("strains of rods are stored only where the recipe asks for them, group by group") {
    const Folder folder;
    folder.write("curves.obj", curves(9, 0.04, 4));
    folder.bake("none.kera", "");
    CHECK(folder.strain("none.kera").empty());
    folder.bake("off.kera",
                ", \"rod\": { \"sag_free\": false }, \"strand\": { \"sag_free\": true }");
    CHECK(folder.strain("off.kera").empty());
    folder.bake("all.kera", ", \"rod\": { \"sag_free\": true }");
    const auto all = folder.strain("all.kera");
    REQUIRE_FALSE(all.empty());
    for (std::size_t lane = 0; lane < 9; ++lane) {
        double largest = 0;
        for (std::size_t c = 0; c < 4; ++c) {
            CHECK(all[vector_index(0, 4, c, lane)] == 0);
            largest = std::max(largest, std::fabs(double(all[vector_index(1, 4, c, lane)])));
        }
        CHECK(largest > 1e-6);
    }
    const json report = folder.bake("default.kera",
                                    ", \"rod\": { \"sag_free\": true }, \"groups\": [{ \"name\": "
                                    "\"default\", \"rod\": { \"sag_free\": false } }]");
    CHECK(folder.strain("default.kera").empty());
    CHECK_FALSE(report.contains("rod_sag_free"));
}
