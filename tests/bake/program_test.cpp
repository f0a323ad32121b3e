// keratin-bake as a user runs it.
#include "schema/asset_view.h"
#include "schema/files/write_file.h"
#include "tests/data_dir.h"
#include "tests/json_schema.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sys/wait.h>

using namespace keratin;
namespace fs = std::filesystem;

namespace {

const std::string kData = KERATIN_DATA_DIR;

struct Ran {
    int code;
    std::string out, err;
};

class Folder {
  public:
    Folder() {
        std::string name = (fs::temp_directory_path() / "keratin_bake.XXXXXX").string();
        path_ = mkdtemp(name.data());
    }
    ~Folder() { fs::remove_all(path_); }
    std::string operator/(const std::string& name) const { return path_ + "/" + name; }

    Ran bake(const std::string& arguments) const {
        const std::string command = std::string(KERATIN_BAKE) + " " + arguments + " >" + path_ +
                                    "/.out 2>" + path_ + "/.err";
        const int status = std::system(command.c_str());
        return {WEXITSTATUS(status), text("/.out"), text("/.err")};
    }
    void write(const std::string& name, const std::string& content) const {
        std::ofstream(path_ + "/" + name, std::ios::binary) << content;
    }
    std::string text(const std::string& name) const {
        std::ifstream in(path_ + "/" + name, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

  private:
    std::string path_;
};

nlohmann::json schema(const std::string& name) {
    std::ifstream file(kData + "/../schema/report/" + name + ".schema.json");
    return nlohmann::json::parse(file);
}

AssetView opened(const std::string& path) {
    auto view = AssetView::open(path);
    if (!view) FAIL(to_string(view.error()));
    return *std::move(view);
}

}  // namespace

TEST_CASE("the same bytes come out for 1, 2 and 7 threads, and nothing names this machine") {
    const Folder folder;
    for (const char* recipe : {"ponytail/head", "ratboy/mohawk"}) {
        std::string first;
        for (const char* threads : {"1", "2", "7"}) {
            const Ran ran = folder.bake(kData + "/" + recipe + ".json -o " + (folder / "a.kera") +
                                        " --quiet --threads " + threads);
            INFO(ran.err);
            REQUIRE(ran.code == 0);
            CHECK(ran.out.empty());
            const std::string bytes = folder.text("a.kera");
            if (first.empty()) first = bytes;
            CHECK(bytes == first);
            fs::remove(folder / "a.kera");
        }
        CHECK(first.size() > 1000000);
        CHECK(first.find(kData) == std::string::npos);
        CHECK(first.find(fs::current_path().string()) == std::string::npos);
    }
}

TEST_CASE("colliders fitted to the ponytail head cover it where hair reaches") {
    const Folder folder;
    const Ran ran =
        folder.bake(kData + "/ponytail/fitted.json -o " + (folder / "head.kera") + " --json");
    REQUIRE(ran.code == 0);
    CHECK(opened(folder / "head.kera").info().colliders.size() > 20);
    const auto report = nlohmann::json::parse(ran.out);
    CHECK(report["colliders"]["mesh_outside"]["p95"].get<double>() < 0.001);
}

TEST_CASE("the ponytail head is baked whole") {
    const Folder folder;
    const Ran ran =
        folder.bake(kData + "/ponytail/head.json -o " + (folder / "head.kera") +
                    " --json --depfile " + (folder / "head.d") + " --sarif " +
                    (folder / "head.sarif") + " --export-guides " + (folder / "guides.obj"));
    REQUIRE(ran.code == 0);
    const AssetView asset = opened(folder / "head.kera");
    CHECK(asset.info().strand_count == 876 + 3066 + 517 + 255);
    CHECK(asset.info().guide_count == 88 + 307 + 52 + 26);
    CHECK(asset.info().groups.size() == 4);
    CHECK(asset.info().mesh_triangle_count == 17894);
    CHECK(asset.info().distance_grid.stored_bricks > 1000);
    CHECK(asset.fields().strand_uv.size() == 2 * asset.info().strand_count);

    const auto report = nlohmann::json::parse(ran.out);
    CHECK(report["strands"] == asset.info().strand_count);
    CHECK(test::schema_misfit(schema("keratin-bake"), report) == "");
    CHECK(report["reconstruction"]["error"]["p95"].get<double>() > 0);
    CHECK(report["sag_free"]["guides"] == asset.info().guide_count);
    CHECK(report["sag_free"]["each"].size() == asset.info().guide_count);
    const std::uint64_t soft = report["sag_free"]["too_soft"];
    CHECK(soft < 30);
    for (const auto& finding : report["findings"])
        if (finding["code"] == "KB025") CHECK(finding["strand_count"] == soft);
    CHECK(report["sources"][0]["root_end"] == "first");
    // Height of the head, 0.247 m, as FORMATS' scale gives it.
    CHECK(report["body_size"][1].get<double>() == Approx(0.247).margin(0.001));
    CHECK(report["inside"]["strands"].get<int>() > 500);

    const std::string depfile = folder.text("head.d");
    for (const char* input : {"head.json", "front_top.tfx", "tail.tfx", "ponytail.obj"}) {
        CHECK(depfile.find(input) != std::string::npos);
    }
    CHECK(nlohmann::json::parse(folder.text("head.sarif"))["version"] == "2.1.0");
    const std::string guides = folder.text("guides.obj");
    std::size_t lines = 0;
    for (std::size_t i = 0; i + 1 < guides.size(); ++i)
        lines += guides[i] == '\n' && guides[i + 1] == 'l';
    CHECK(lines == asset.info().guide_count * 15);
}

TEST_CASE("the mohawk is bound to its bones and loses its collapsed strands") {
    const Folder folder;
    const std::string bake = kData + "/ratboy/mohawk.json -o " + (folder / "m.kera");
    const Ran ran = folder.bake(bake);
    REQUIRE(ran.code == 0);
    CHECK(ran.out.find("KB001 degenerate-strand") != std::string::npos);
    const AssetView asset = opened(folder / "m.kera");
    CHECK(asset.info().bones.size() == 105);
    CHECK(asset.info().strand_count < 2228);
    CHECK(asset.info().strand_count > 2200);
    CHECK(asset.fields().strand_bone.size() == 4 * asset.info().strand_count);
    const Ran strict = folder.bake(bake + " --strict");
    CHECK(strict.code == 2);
    CHECK(strict.err.find("Ratboy_mohawk.tfx: strands") != std::string::npos);
}

TEST_CASE("checking accepts what was baked and says no to a damaged file") {
    const Folder folder;
    folder.write("f.json", "{ \"scale\": 0.01, \"points_per_strand\": 4, \"curves\": [ { \"file\": \"" +
                               kData + "/tressfx/TestHair1.tfx\" } ],\n\"mesh\": { \"file\": \"" +
                               kData + "/tressfx/TestObject1.obj\" },\n\"distance_grid\": {}, "
                               "\"quantise\": { \"max_error\": 1e-3 } }");
    const Ran baked = folder.bake((folder / "f.json") + " --json -o " + (folder / "f.kera"));
    REQUIRE(baked.code == 0);
    CHECK(test::schema_misfit(schema("keratin-bake"), nlohmann::json::parse(baked.out)) == "");
    CHECK(folder.bake("--check " + (folder / "f.kera")).code == 0);
    const auto sound =
        nlohmann::json::parse(folder.bake("--json --check " + (folder / "f.kera")).out);
    CHECK(test::schema_misfit(schema("keratin-bake-check"), sound) == "");
    CHECK(sound["ok"] == true);
    for (const char* accuracy : {"guide_error", "distance_grid", "packed_max_error", "levels"})
        CHECK(sound.contains(accuracy));
    std::string bytes = folder.text("f.kera");
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    folder.write("g.kera", bytes);
    const Ran damaged = folder.bake("--check " + (folder / "g.kera") + " --json");
    CHECK(damaged.code == 1);
    const auto refusal = nlohmann::json::parse(damaged.out);
    CHECK(test::schema_misfit(schema("keratin-bake-check"), refusal) == "");
    CHECK(refusal["ok"] == false);
    CHECK(refusal.contains("message"));
    CHECK(folder.bake("--check " + (folder / "none.kera")).code == 2);
}

TEST_CASE("bad input gets exit code 2, one message naming file and place, and leaves no file") {
    const Folder folder;
    const std::string tail = kData + "/tressfx/tail.tfx";
    const auto refuses = [&](const std::string& recipe, const std::string& says) {
        folder.write("bad.json", recipe);
        const Ran ran = folder.bake((folder / "bad.json") + " -o " + (folder / "bad.kera"));
        INFO(ran.err);
        CHECK(ran.code == 2);
        CHECK(ran.out.empty());
        CHECK(std::count(ran.err.begin(), ran.err.end(), '\n') == 1);
        CHECK(ran.err.find(says) != std::string::npos);
        CHECK_FALSE(fs::exists(folder / "bad.kera"));
    };
    const auto with = [&](const std::string& rest) {
        return "{ \"curves\": [ { \"file\": \"" + tail + "\" } ]" + rest + " }";
    };
    refuses("{ \"curves\": [ { \"file\": \"none.tfx\" } ] }", "none.tfx");
    refuses(with(", \"guide\": 1"), "guide");
    refuses(with(", \"scale\": \"big\""), "bad.json");
    refuses(with(", \"mesh\": { \"file\": \"none.obj\" }"), "none.obj");
    refuses(with(", \"scale\": 1e9"), "strand 0");

    std::string bytes;
    {
        std::ifstream in(tail, std::ios::binary);
        bytes.assign(std::istreambuf_iterator<char>(in), {});
    }
    folder.write("cut.tfx", bytes.substr(0, bytes.size() / 2));
    refuses("{ \"curves\": [ { \"file\": \"cut.tfx\" } ] }", "cut.tfx");
    folder.write("empty.obj", "v 0 0 0\nv 1 0 0\n");
    refuses(with(", \"mesh\": { \"file\": \"empty.obj\" }"), "empty.obj");
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    refuses(with(", \"mesh\": { \"file\": \"flat.obj\" }"), "flat.obj");

    CHECK(folder.bake("").code == 2);
    CHECK(folder.bake("x.json").code == 2);
    CHECK(folder.bake("--nonsense").code == 2);
    CHECK(folder.bake("--help").code == 0);
    CHECK(folder.bake("--version").out.find("revision") != std::string::npos);
}

TEST_CASE("a failed bake leaves the old asset alone") {
    const Folder folder;
    folder.write("a.kera", "old");
    folder.write("bad.json", "{ \"curves\": [ { \"file\": \"none.tfx\" } ] }");
    CHECK(folder.bake((folder / "bad.json") + " -o " + (folder / "a.kera")).code == 2);
    CHECK(folder.text("a.kera") == "old");
}

TEST_CASE("positions in 16 bits stay within the bound, or the bake fails and says what would do") {
    const Folder folder;
    const auto recipe = [&](const std::string& quantise) {
        return "{ \"scale\": 0.0027, \"curves\": [ { \"file\": \"" + kData +
               "/tressfx/tail.tfx\" } ]" + quantise + " }";
    };
    folder.write("plain.json", recipe(""));
    folder.write("packed.json", recipe(", \"quantise\": {}"));
    folder.write("tight.json", recipe(", \"quantise\": { \"max_error\": 1e-7 }"));
    REQUIRE(folder.bake((folder / "plain.json") + " -o " + (folder / "plain.kera")).code == 0);
    const Ran packed =
        folder.bake((folder / "packed.json") + " -o " + (folder / "packed.kera") + " --json");
    REQUIRE(packed.code == 0);
    const AssetView a = opened(folder / "plain.kera"), b = opened(folder / "packed.kera");
    CHECK_FALSE(a.info().packed);
    CHECK(b.info().packed);
    CHECK(b.bytes().size() < a.bytes().size());
    const auto x = a.fields().strand_position, y = b.fields().strand_position;
    REQUIRE(x.size() == y.size());
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); i += 3) {
        double squared = 0;
        for (std::size_t k = i; k < i + 3; ++k)
            squared += (double(x[k]) - double(y[k])) * (double(x[k]) - double(y[k]));
        largest = std::max(largest, std::sqrt(squared));
    }
    CHECK(largest > 0);
    CHECK(largest < double(b.info().packed_max_error) + 1e-7);  // rounding of the floats themselves
    CHECK(b.info().packed_max_error < 5e-5f);
    const auto report = nlohmann::json::parse(packed.out);
    CHECK(report["quantised"]["bytes"].get<double>() <
          0.6 * report["quantised"]["bytes_before"].get<double>());
    // Guides are simulated: they keep their floats.
    CHECK(std::equal(a.fields().guide_position.begin(), a.fields().guide_position.end(),
                     b.fields().guide_position.begin()));

    const Ran tight = folder.bake((folder / "tight.json") + " -o " + (folder / "tight.kera"));
    CHECK(tight.code == 2);
    CHECK(tight.err.find("tight.json: quantise.max_error: ") != std::string::npos);
    CHECK(tight.err.find("tail.tfx: strand ") != std::string::npos);
    CHECK_FALSE(fs::exists(folder / "tight.kera"));
    const Ran check = folder.bake("--check " + (folder / "packed.kera") + " --json");
    CHECK(check.code == 0);
    CHECK(nlohmann::json::parse(check.out)["packed_max_error"].get<float>() ==
          b.info().packed_max_error);
}

TEST_CASE("the guides' error is stored where it is measured, and measured when asked for") {
    const Folder folder;
    const auto baked = [&](const std::string& guides) {
        folder.write("r.json", "{ \"scale\": 0.0027, \"curves\": [ { \"file\": \"" + kData +
                                   "/tressfx/back.tfx\" } ], \"guides\": { " + guides + " } }");
        const Ran ran = folder.bake((folder / "r.json") + " -o " + (folder / "r.kera") + " --json");
        INFO(ran.err);
        REQUIRE(ran.code == 0);
        const auto report = nlohmann::json::parse(ran.out);
        const AssetView asset = opened(folder / "r.kera");
        CHECK(report.contains("reconstruction") == !asset.info().guide_error.method.empty());
        if (report.contains("reconstruction"))
            CHECK(report["reconstruction"]["error"]["p95"].get<float>() ==
                  Approx(asset.info().guide_error.p95));
        return asset.info().guide_error;
    };
    CHECK(baked("\"measure\": false") == GuideError{});
    const GuideError random = baked("\"method\": \"random\"");
    const GuideError kmeans = baked("\"method\": \"kmeans\", \"measure\": true");
    const GuideError motion = baked("\"method\": \"motion\"");
    CHECK(random.method == "random");
    CHECK(motion.method == "motion");
    CHECK(kmeans.mean > 0);
    CHECK(kmeans.mean < kmeans.p95);
    CHECK(kmeans.p95 < kmeans.max);
    CHECK(kmeans.mean < random.mean);
    CHECK(motion.mean < kmeans.mean);
    CHECK(motion.p95 < kmeans.p95);

    folder.write("two.json", "{ \"points_per_strand\": 2, \"curves\": [ { \"file\": \"" + kData +
                                 "/tressfx/back.tfx\" } ], \"guides\": { \"measure\": true } }");
    const Ran refused = folder.bake((folder / "two.json") + " -o " + (folder / "two.kera"));
    CHECK(refused.code == 2);
    CHECK(refused.err.find("two.json: guides.measure: ") != std::string::npos);
}

TEST_CASE("guides that are exported can be baked again, in each format") {
    const Folder folder;
    folder.write("r.json", "{ \"scale\": 0.0027, \"curves\": [ { \"file\": \"" + kData +
                               "/tressfx/tail.tfx\" } ] }");
    // A strand as its id and points, so that it can be looked for whatever its place.
    using Strand = std::vector<float>;
    const auto strands_of = [](const AssetView& asset, bool guides_only) {
        const AssetFields& f = asset.fields();
        std::vector<Strand> out;
        const auto add = [&](std::uint32_t s) {
            out.emplace_back(f.strand_position.begin() + 3 * f.strand_first_point[s],
                             f.strand_position.begin() + 3 * f.strand_first_point[s + 1]);
        };
        if (guides_only) {
            for (std::uint32_t s : f.guide_strand)
                if (s != kNoStrand) add(s);
        } else {
            for (std::uint32_t s = 0; s < asset.info().strand_count; ++s) add(s);
        }
        std::sort(out.begin(), out.end());
        return out;
    };
    for (const std::string ending : {"abc", "hair", "obj"}) {
        INFO(ending);
        const std::string exported = folder / ("guides." + ending);
        REQUIRE(folder.bake((folder / "r.json") + " -o " + (folder / "r.kera") +
                            " --export-guides " + exported)
                    .code == 0);
        folder.write("again.json", "{ \"curves\": [ { \"file\": \"guides." + ending +
                                       "\", \"root_end\": \"first\" } ] }");
        const Ran again = folder.bake((folder / "again.json") + " -o " + (folder / "again.kera"));
        INFO(again.err);
        REQUIRE(again.code == 0);
        const auto expected = strands_of(opened(folder / "r.kera"), true);
        const auto found = strands_of(opened(folder / "again.kera"), false);
        REQUIRE(found.size() == expected.size());
        float largest = 0, ends = 0;
        for (std::size_t s = 0; s < found.size(); ++s) {
            REQUIRE(found[s].size() == expected[s].size());
            const std::size_t n = found[s].size();
            for (std::size_t i = 0; i < n; ++i) {
                const float apart = std::abs(found[s][i] - expected[s][i]);
                largest = std::max(largest, apart);
                if (i < 3 || i + 3 >= n) ends = std::max(ends, apart);
            }
        }
        // Roots and tips stay; baking evens out the arc length between the points in between anew.
        CHECK(ends < 1e-6f);
        CHECK(largest < 1e-4f);
    }
}

TEST_CASE("an output never eats an input or another output") {
    const Folder folder;
    fs::copy_file(kData + "/tressfx/tail.tfx", folder / "tail.tfx");
    const std::string recipe = "{ \"curves\": [ { \"file\": \"tail.tfx\" } ] }";
    folder.write("r.json", recipe);
    const std::string curves = folder.text("tail.tfx"), r = folder / "r.json";
    for (const std::string& outputs :
         {"-o " + r, "-o " + (folder / "tail.tfx"),
          "-o " + (folder / "a.kera") + " --sarif " + (folder / "tail.tfx"),
          "-o " + (folder / "a.kera") + " --depfile " + (folder / "a.kera"),
          "-o " + (folder / "a.kera") + " --export-guides " + (folder / "a.xyz")}) {
        INFO(outputs);
        const Ran ran = folder.bake(r + " " + outputs);
        INFO(ran.err);
        CHECK(ran.code == 2);
        CHECK(std::count(ran.err.begin(), ran.err.end(), '\n') == 1);
        CHECK(folder.text("r.json") == recipe);
        CHECK(folder.text("tail.tfx") == curves);
        CHECK_FALSE(fs::exists(folder / "a.kera"));
    }
    CHECK(folder.bake(r + " --check " + (folder / "a.kera")).code == 2);
}

TEST_CASE("names with spaces and letters of any alphabet are no obstacle") {
    const Folder folder;
    fs::create_directories(folder / "h\xc3\xa9 ad");
    fs::copy_file(kData + "/tressfx/tail.tfx", folder / "h\xc3\xa9 ad/t il.tfx");
    folder.write("h\xc3\xa9 ad/r.json", "{ \"curves\": [ { \"file\": \"t il.tfx\" } ] }");
    const std::string asset = folder / "h\xc3\xa9 ad/a #b.kera";
    const Ran ran = folder.bake("'" + (folder / "h\xc3\xa9 ad/r.json") + "' -o '" + asset +
                                "' --quiet --depfile '" + (folder / "d") + "'");
    INFO(ran.err);
    CHECK(ran.code == 0);
    CHECK(fs::exists(asset));
    CHECK(folder.text("d").find("t\\ il.tfx") != std::string::npos);
}

TEST_CASE("what cannot be printed is an error") {
    const Folder folder;
    const Ran ran = folder.bake(kData + "/testhair/fur.json -o " + (folder / "a.kera") +
                                " --json >/dev/full; test $? = 2 && echo right");
    CHECK(ran.out == "right\n");
}
