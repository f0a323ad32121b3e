// keratin-bake: a groom recipe, curves and a mesh become one asset.
#include "bake/output.h"
#include "bake/read/read_curves.h"
#include "bake/read/read_mesh.h"
#include "bake/report.h"
#include "bake/stage/bones.h"
#include "bake/stage/colliders.h"
#include "bake/stage/degenerate.h"
#include "bake/stage/density.h"
#include "bake/stage/distance_grid.h"
#include "bake/stage/evaluate.h"
#include "bake/stage/guides.h"
#include "bake/stage/inside.h"
#include "bake/stage/levels.h"
#include "bake/stage/motion.h"
#include "bake/stage/order.h"
#include "bake/stage/place.h"
#include "bake/stage/quantise.h"
#include "bake/stage/resample.h"
#include "bake/stage/rest.h"
#include "bake/stage/root_end.h"
#include "bake/stage/roots.h"
#include "bake/stage/sag_free.h"
#include "bake/stage/size.h"
#include "bake/stage/weights.h"
#include "bake/write.h"
#include "runtime/export/strand_export.h"
#ifdef KERATIN_WITH_ROD
#include "runtime/rod/rod_statics.h"
#endif
#include "runtime/simulation.h"
#include "schema/asset_view.h"
#include "schema/file_hash.h"
#include "schema/files/program.h"
#include "schema/files/write_file.h"
#include "schema/mapped_file.h"
#include "schema/read/recipe.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <numeric>
#include <omp.h>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

using namespace keratin;

namespace {

constexpr int kDone = 0, kNo = 1, kWrong = 2;

struct Options {
    std::string recipe, output, check, depfile, sarif, export_guides;
    int threads = 0;
    bool strict = false, explain = false, json = false, quiet = false, keep_mtime = false;
};

std::string version_text() {
    return "keratin-bake " KERATIN_VERSION ", asset revision " + std::to_string(kAssetMajor) + "." +
           std::to_string(kAssetMinor);
}

// Times the stages, and shows them on stderr when that is a terminal and the bake takes long.
class Stages {
  public:
    explicit Stages(bool show) : show_(show && isatty(STDERR_FILENO)) {}
    ~Stages() {
        if (shown_) std::fprintf(stderr, "\r\033[K");
    }

    void begin(const char* name) {
        end();
        name_ = name;
        cpu_begin_ = std::clock();
        ++count_;
        const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start_;
        if (!show_ || since.count() < kQuietSeconds) return;
        const int filled = count_ * kBarWidth / kStageCount;
        std::fprintf(stderr, "\r\033[K[%s%s] %s",
                     std::string(std::min(filled, kBarWidth), '#').c_str(),
                     std::string(std::max(kBarWidth - filled, 0), '.').c_str(), name);
        shown_ = true;
    }
    std::vector<BakeReport::StageTime> times() {
        end();
        return times_;
    }

  private:
    static constexpr double kQuietSeconds = 1;
    static constexpr int kBarWidth = 20, kStageCount = 19;

    void end() {
        if (name_ == nullptr) return;
        times_.push_back({name_, static_cast<double>(std::clock() - cpu_begin_) / CLOCKS_PER_SEC});
        name_ = nullptr;
    }

    bool show_, shown_ = false;
    int count_ = 0;
    const char* name_ = nullptr;
    std::clock_t cpu_begin_ = 0;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::vector<BakeReport::StageTime> times_;
};

struct Inputs {
    std::vector<RawGroom> grooms;
    std::vector<std::optional<RawSkin>> skins;
    std::optional<RawMesh> mesh;
    std::vector<std::string> files;  // every file read
    std::vector<InputRecord> records;
};

Result<void> record(const std::string& role, const std::string& path, Inputs& inputs) {
    inputs.files.push_back(path);
    const auto file = MappedFile::open(path);
    if (!file) return file.error();
    inputs.records.push_back(
        {role, std::filesystem::path(path).filename().string(), hash_bytes(file->bytes())});
    return {};
}

Result<Inputs> read_inputs(const Recipe& recipe) {
    Inputs out;
    out.files.push_back(recipe.file);
    for (const CurveSource& source : recipe.curves) {
        auto groom = read_curves(source.file, source.time);
        if (!groom) return groom.error();
        if (auto ok = record("curves", source.file, out); !ok) return ok.error();
        for (const std::string& file : groom->dependencies) out.files.push_back(file);
        out.grooms.push_back(*std::move(groom));
        out.skins.emplace_back();
        if (source.bones.empty()) continue;
        auto skin = read_skin(source.bones);
        if (!skin) return skin.error();
        if (auto ok = record("bones", source.bones, out); !ok) return ok.error();
        out.skins.back() = *std::move(skin);
    }
    if (recipe.mesh.empty()) return out;
    auto mesh = read_mesh(recipe.mesh);
    if (!mesh) return mesh.error();
    if (auto ok = record("mesh", recipe.mesh, out); !ok) return ok.error();
    for (const std::string& file : mesh->dependencies) out.files.push_back(file);
    out.mesh = *std::move(mesh);
    return out;
}

struct Baked {
    AssetInfo info;
    AssetArrays arrays;
    BakeReport report;
    Findings findings;
    std::vector<std::string> files;
};

void set_bounds(const AssetArrays& arrays, AssetInfo& info) {
    const std::vector<float>& x = arrays.strand_position;
    float low[3] = {x[0], x[1], x[2]}, high[3] = {x[0], x[1], x[2]};
#pragma omp parallel for schedule(static) reduction(min : low[ : 3]) reduction(max : high[ : 3])
    for (std::size_t p = 0; p < x.size() / 3; ++p) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], x[3 * p + k]);
            high[k] = std::max(high[k], x[3 * p + k]);
        }
    }
    std::copy_n(low, 3, info.bounds_min.begin());
    std::copy_n(high, 3, info.bounds_max.begin());
}

void count_all(const Groom& groom, std::span<const std::uint32_t> guides, const AssetOrder& order,
               AssetInfo& info, BakeReport& report) {
    info.tile_count = static_cast<std::uint32_t>(order.tile_first_row.size() - 1);
    info.row_count = order.tile_first_row.back();
    info.guide_count = static_cast<std::uint32_t>(guides.size());
    info.strand_count = static_cast<std::uint32_t>(groom.strand_count());
    info.point_count = static_cast<std::uint32_t>(groom.position.size());
    report.strands = info.strand_count;
    report.points = info.point_count;
    report.guides = info.guide_count;
    report.tiles = info.tile_count;
    report.rows = info.row_count;
    std::size_t guide_points = 0;
    for (std::uint32_t g : guides) guide_points += groom.point_count(g);
    report.padding =
        1 - static_cast<double>(guide_points) / (static_cast<double>(info.row_count) * kTileLanes);
    report.points_min = kBakeMaxPoints;
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        const auto count = static_cast<std::uint32_t>(groom.point_count(s));
        report.points_min = std::min(report.points_min, count);
        report.points_max = std::max(report.points_max, count);
    }
    for (const std::string& name : groom.group_names) report.groups.push_back({name, 0, 0});
    for (std::uint32_t g : groom.group) ++report.groups[g].strands;
    for (std::uint32_t s : guides) ++report.groups[groom.group[s]].guides;
}

void describe_sources(const Recipe& recipe, const Inputs& inputs, const Groom& groom,
                      std::span<const RootEnds> ends, const Roots& roots, BakeReport& report) {
    std::vector<std::vector<double>> distance(recipe.curves.size());
    std::vector<std::uint64_t> kept(recipe.curves.size());
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        ++kept[groom.source[s]];
        if (!roots.distance.empty()) distance[groom.source[s]].push_back(roots.distance[s]);
    }
    for (std::size_t f = 0; f < recipe.curves.size(); ++f) {
        BakeReport::Source source;
        source.file = recipe.curves[f].file;
        source.curves = inputs.grooms[f].curves.size() + inputs.grooms[f].problems.size();
        source.left_out = source.curves - kept[f];
        source.root_end = ends[f].end;
        source.root_end_from = ends[f].from;
        source.reversed = ends[f].reversed;
        source.scale = metres_per_unit(inputs.grooms[f], recipe, f);
        if (!distance[f].empty()) source.root_distance = spread_of(std::move(distance[f]));
        report.sources.push_back(std::move(source));
    }
}

// Grooms up to this size are shaken to measure their guides; larger ones only to choose guides by
// motion.
constexpr std::size_t kMostMeasured = 20000;

bool solver_takes(const Groom& groom) {
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
        const std::size_t count = groom.point_count(s);
        if (count < kStrandMinPoints || count > kStrandMaxPoints) return false;
    }
    return true;
}

// Whether the guides' error is to be measured. Errors (input): it is, by name, and the solver cannot.
Result<bool> measures_guides(const Groom& groom, const Recipe& recipe) {
    const bool motion = recipe.guide_method == GuideMethod::motion;
    const bool wanted = recipe.guide_measure.value_or(motion);
    if ((wanted || motion) && !solver_takes(groom)) {
        return Error{ErrorCode::input, recipe.file + (motion ? ": guides.method" : ": guides.measure"),
                     "needs the strand solver, which takes strands of 3 to 32 points; some have "
                     "fewer or more, see points_per_strand"};
    }
    if (recipe.guide_measure) return wanted;
    return motion || (groom.strand_count() <= kMostMeasured && solver_takes(groom));
}

void warn_of_point_counts(const BakeReport& report, Findings& findings) {
    if (report.points_min >= kStrandMinPoints && report.points_max <= kStrandMaxPoints) return;
    findings.push_back({Rule::points_for_strand,
                        "",
                        "strands have " + std::to_string(report.points_min) + " to " +
                            std::to_string(report.points_max) +
                            " points; the strand solver takes 3 to 32, other solvers take these",
                        {}});
}

// How a head is shaken: a swing as an acceleration, in multiples of 1 Hz, sideways and forth and
// back. Guides learn from one and are judged by the other.
struct Shake {
    double across, along, phase;
};
constexpr Shake kLearn{1.4, 0.9, 0.25}, kJudge{1.0, 1.3, 0};

// Shakes the whole groom, every strand simulated, in the frame of the head, for 1 s (10 cm at 1 Hz).
//   sag_free  [groups]  whose rest shapes are to be made so
Result<GroomMotion> shake(const Groom& groom, std::span<const GroupInfo> groups,
                          std::span<const std::uint8_t> sag_free, const Shake& motion,
                          int threads) {
    constexpr double kFrame = 1.0 / 60, kSwing = 3.9;
    constexpr int kFrames = 60, kKeptEvery = 10;
    std::vector<std::uint32_t> all(groom.strand_count());
    std::iota(all.begin(), all.end(), 0u);
    const AssetOrder order = order_asset(groom, all);
    std::vector<GuideBlend> blends(all.size());
    for (std::uint32_t s : all) blends[s].guide.fill(s);
    AssetArrays arrays;
    store_strands(groom, {}, {}, order, blends, groups, arrays);
    // Strands that cannot be held are named once, as guides.
    Findings unnamed;
    make_sag_free(groups, sag_free, arrays, unnamed);
    AssetInfo info;
    info.groups.assign(groups.begin(), groups.end());
    BakeReport counts;
    count_all(groom, all, order, info, counts);
    set_bounds(arrays, info);
    Settings settings;
    settings.threads = threads;
    settings.teleport_distance = 0;
    settings.passes.interpolation = false;
    auto simulation = Simulation::create(info, arrays.fields(), settings);
    if (!simulation) return simulation.error();

    GroomMotion out;
    for (int frame = 1; frame <= kFrames; ++frame) {
        const auto swing = [&](double frequency) {
            return static_cast<float>(
                kSwing *
                std::sin(2 * std::numbers::pi * (frequency * kFrame * frame + motion.phase)));
        };
        const std::array<float, 3> gravity{swing(motion.across), -9.81f, swing(motion.along)};
        if (auto ok = simulation->set_gravity(gravity); !ok) return ok.error();
        if (auto ok = simulation->step(kFrame); !ok) return ok.error();
        if (frame % kKeptEvery != 0) continue;
        const std::size_t first = out.displacement.size();
        out.displacement.resize(first + 3 * groom.position.size());
        const auto position = simulation->guides().position;
        for (std::uint32_t s : all) {
            const std::size_t tile = order.lane_of[s] / kTileLanes;
            const std::size_t lane = order.lane_of[s] % kTileLanes;
            for (std::size_t p = 0; p < groom.point_count(s); ++p) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::size_t at = vector_index(order.tile_first_row[tile] + p, 3, k, lane);
                    out.displacement[first + 3 * (groom.first_point[s] + p) + k] =
                        position[at] - arrays.guide_position[at];
                }
            }
        }
        ++out.frame_count;
    }
    return out;
}

// What the rod solver's statics say of a guide.
HeldRod hold_rod([[maybe_unused]] std::span<const std::array<double, 3>> points,
                 [[maybe_unused]] const std::array<double, 3>& director,
                 [[maybe_unused]] const Material& material) {
    HeldRod out;
#ifdef KERATIN_WITH_ROD
    static_assert(kMostBorneStretch <= kMostRodStretch && kMostBorneBend <= kMostRodBend &&
                  kMostBorneTwist <= kMostRodTwist);
    RodStrand strand;
    strand.points.assign(points.begin(), points.end());
    strand.material = {{material.radius, material.radius2},
                       material.density,
                       material.youngs_modulus,
                       material.poisson_ratio,
                       material.viscosity,
                       0};
    strand.root = RodEnd::clamped;
    strand.root_frame.normal = director;
    const WeightBorne borne = bear_weight(strand, {0, -9.81, 0});
    for (const RodStrain& s : borne.strain)
        out.strain.push_back({static_cast<float>(s.stretch), static_cast<float>(s.bend[0]),
                              static_cast<float>(s.bend[1]), static_cast<float>(s.twist)});
    out.held = borne.held;
    out.residual = borne.residual;
    out.settles = borne.settles;
#endif
    return out;
}

// CPU time of each thread that has worked so far, and the most memory that was resident.
BakeReport::Cost cost_so_far() {
    BakeReport::Cost out;
    out.threads = omp_get_max_threads();
    double busiest = 0;
#pragma omp parallel reduction(max : busiest)
    {
        timespec t{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
        busiest = static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    }
    out.busiest_cpu_seconds = busiest;
    out.cpu_seconds = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
    // Not from getrusage: that would count what the shell held before it became this program.
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmHWM:")) out.peak_bytes = std::stoull(line.substr(6)) * 1024;
    }
    return out;
}

const char* method_name(GuideMethod method) {
    switch (method) {
        case GuideMethod::random:
            return "random";
        case GuideMethod::kmeans:
            return "kmeans";
        case GuideMethod::authored:
            return "authored";
        case GuideMethod::motion:
            break;
    }
    return "motion";
}

Result<Baked> bake(const Options& options) {
    Baked out;
    Findings& findings = out.findings;
    const Strictness strictness = options.strict ? Strictness::strict : Strictness::lenient;
    Stages stages(!options.quiet && !options.json);

    stages.begin("recipe");
    const auto recipe = read_recipe(options.recipe);
    if (!recipe) return recipe.error();
    stages.begin("read");
    auto inputs = read_inputs(*recipe);
    if (!inputs) return inputs.error();
    RawMesh* mesh = inputs->mesh ? &*inputs->mesh : nullptr;
    std::vector<std::size_t> curve_counts;
    for (const RawGroom& groom : inputs->grooms) {
        curve_counts.push_back(groom.curves.size() + groom.problems.size());
    }

    stages.begin("place");
    if (auto ok = place_curves(*recipe, inputs->grooms, findings); !ok) return ok.error();
    if (mesh != nullptr) {
        if (auto ok = place_mesh(*recipe, *mesh); !ok) return ok.error();
    }
    const auto surfaces = find_growth_surfaces(*recipe, mesh, findings);
    if (!surfaces) return surfaces.error();

    stages.begin("evaluate");
    auto curves = evaluate_curves(inputs->grooms, *recipe, strictness, findings);
    if (!curves) return curves.error();
    auto sound = drop_degenerate(*std::move(curves), *recipe, strictness, findings);
    if (!sound) return sound.error();
    stages.begin("root ends");
    const auto ends = orient_strands(*recipe, surfaces->of_source, *sound, findings);
    stages.begin("resample");
    Groom groom = resample(*std::move(sound), *recipe, findings);
    stages.begin("inside");
    if (mesh != nullptr) {
        out.report.inside = find_inside(*surfaces, *recipe, groom, findings);
    }
    measure_sizes(groom, mesh, *surfaces, out.report, findings);
    stages.begin("roots");
    const Roots roots = bind_roots(groom, *surfaces, *recipe, findings);
    const auto carriers =
        carry_roots(groom, inputs->skins, mesh, roots, *recipe, curve_counts, findings);
    if (!carriers) return carriers.error();
    out.info.groups = group_settings(groom, *recipe, findings);
    const auto sag_free = sag_free_groups(out.info.groups, *recipe);
    const auto rod_sag_free = rod_sag_free_groups(out.info.groups, *recipe);
#ifndef KERATIN_WITH_ROD
    if (std::ranges::count(rod_sag_free, 1) > 0)
        return Error{ErrorCode::unsupported, recipe->file + ": rod.sag_free",
                     "this build has no rod solver; build with KERATIN_WITH_ROD or leave it out"};
#endif
    stages.begin("motion");
    std::optional<GroomMotion> motion;
    if (recipe->guide_method == GuideMethod::motion) {
        if (auto ok = measures_guides(groom, *recipe); !ok) return ok.error();
        auto shaken = shake(groom, out.info.groups, sag_free, kLearn, options.threads);
        if (!shaken) return shaken.error();
        motion = *std::move(shaken);
    }
    stages.begin("guides");
    const auto features = strand_features(groom);
    const auto guides =
        choose_guides(groom, features, roots, motion ? &*motion : nullptr, *recipe, findings);
    if (!guides) return guides.error();
    stages.begin("weights");
    const auto blends = blend_guides(groom, features, *guides, roots, *recipe, findings,
                                     motion ? &*motion : nullptr);
    motion.reset();
    stages.begin("measure");
    const auto measure = measures_guides(groom, *recipe);
    if (!measure) return measure.error();
    if (*measure) {
        const auto shaken = shake(groom, out.info.groups, sag_free, kJudge, options.threads);
        if (!shaken) return shaken.error();
        const Spread error = reconstruction_error(groom, *shaken, blends);
        out.report.reconstruction = {method_name(recipe->guide_method), error};
        out.info.guide_error = {method_name(recipe->guide_method), static_cast<float>(error.mean),
                                static_cast<float>(error.p95), static_cast<float>(error.max)};
    }
    stages.begin("order");
    const AssetOrder order = order_asset(groom, *guides);
    stages.begin("rest");
    store_strands(groom, roots, *carriers, order, blends, out.info.groups, out.arrays);
    stages.begin("sag-free");
    if (std::ranges::count(sag_free, 1) > 0) {
        out.report.sag_free = make_sag_free(out.info.groups, sag_free, out.arrays, findings);
    }
    stages.begin("sag-free rods");
    if (std::ranges::count(rod_sag_free, 1) > 0) {
        out.report.rod_sag_free =
            make_rods_sag_free(out.info.groups, rod_sag_free, hold_rod, out.arrays, findings);
    }
    stages.begin("mesh");
    store_mesh(mesh, roots, *recipe, out.info, out.arrays);
    if (auto ok =
            quantise_positions(groom, order, *recipe, out.info, out.arrays, out.report);
        !ok)
        return ok.error();
    out.info.levels = width_levels(out.arrays, out.info.groups);
    for (const LevelOfDetail& level : out.info.levels) {
        out.report.levels.push_back({level.strand_count, level.width_scale});
    }
    count_all(groom, *guides, order, out.info, out.report);
    set_bounds(out.arrays, out.info);
    store_density(out.info, out.arrays);
    stages.begin("colliders");
    if (recipe->colliders == ColliderMethod::fit) {
        ColliderFit fit = fit_colliders(*mesh, groom, *carriers, findings);
        out.info.colliders = std::move(fit.colliders);
        out.report.colliders = fit.measured;
    }

    stages.begin("distance grid");
    if (recipe->distance_grid) {
        auto grid = make_distance_grid(*mesh, groom, *carriers, *recipe);
        if (!grid) return grid.error();
        out.info.distance_grid = grid->info;
        out.arrays.grid_brick = std::move(grid->brick);
        out.arrays.grid_distance = std::move(grid->distance);
        out.report.distance_grid = grid->measured;
    }

    out.info.tool_version = "keratin-bake " KERATIN_VERSION;
    out.info.recipe_hash =
        hash_bytes(std::as_bytes(std::span(recipe->text.data(), recipe->text.size())));
    out.info.inputs = inputs->records;
    out.info.attach = recipe->attach;
    out.info.bones = carriers->bones;
    describe_sources(*recipe, *inputs, groom, ends, roots, out.report);
    warn_of_point_counts(out.report, findings);
    out.report.recipe = options.recipe;
    out.report.output = options.output;
    out.report.defaulted = recipe->defaulted;
    out.report.times = stages.times();
    out.files = inputs->files;
    return out;
}

// The guides as curves, root first, in m; with their ids.
Result<void> export_guides(const std::string& path, const Baked& baked) {
    ExportStrands strands;
    std::vector<float> position;
    strands.first_point.push_back(0);
    const AssetArrays& a = baked.arrays;
    for (std::size_t lane = 0; lane < a.guide_strand.size(); ++lane) {
        const std::uint32_t s = a.guide_strand[lane];
        if (s == kNoStrand) continue;
        position.insert(position.end(), a.strand_position.begin() + 3 * a.strand_first_point[s],
                        a.strand_position.begin() + 3 * a.strand_first_point[s + 1]);
        strands.first_point.push_back(static_cast<std::uint32_t>(position.size() / 3));
        strands.radius.push_back(a.strand_radius.empty()
                                     ? baked.info.groups[a.strand_group[s]].material.radius
                                     : a.strand_radius[s]);
        strands.id.push_back(a.strand_id[s]);
        strands.is_guide.push_back(1);
        if (a.strand_uv.empty()) continue;
        strands.uv.insert(strands.uv.end(), {a.strand_uv[2 * s], a.strand_uv[2 * s + 1]});
    }
    auto exporter = StrandExporter::create(path, std::move(strands), 0, 1);
    if (!exporter) return exporter.error();
    if (auto ok = (*exporter)->add(position); !ok) return ok;
    return (*exporter)->finish();
}

std::string explain(const Baked& baked) {
    std::string out;
    const auto stage = [&](const char* name, bool runs, const std::string& why) {
        out += std::string(runs ? "  runs     " : "  left out ") + name + ": " + why + "\n";
    };
    out += "stages\n";
    const bool mesh = baked.report.mesh_size.has_value();
    stage("roots on triangles", mesh, mesh ? "the recipe names a mesh" : "no mesh");
    stage("bones", !baked.info.bones.empty(),
          baked.info.bones.empty() ? "neither .tfxbone nor a skinned mesh"
                                   : std::to_string(baked.info.bones.size()) + " bones");
    stage("colliders", baked.report.colliders.has_value(),
          baked.report.colliders ? "\"colliders\": \"fit\"" : "\"colliders\" is \"none\"");
    stage("stored mesh", !baked.arrays.mesh_triangle.empty(),
          baked.arrays.mesh_triangle.empty() ? "roots do not follow triangles"
                                             : std::to_string(baked.info.triangle_count) +
                                                   " triangles that carry roots, or as asked");
    stage("guides measured in motion", baked.report.reconstruction.has_value(),
          baked.report.reconstruction ? "1 s of shaking, every strand simulated"
                                      : "\"guides\": { \"measure\": true } asks for it; up to " +
                                            std::to_string(kMostMeasured) +
                                            " strands of 3 to 32 points are measured anyway");
    stage("sag-free rest shapes", baked.report.sag_free.has_value(),
          baked.report.sag_free
              ? std::to_string(baked.report.sag_free->guides) + " guides, of which " +
                    std::to_string(baked.report.sag_free->too_soft) + " are too soft"
              : "\"strand\": { \"sag_free\": true } asks for them");
    stage("sag-free rest shapes of rods", baked.report.rod_sag_free.has_value(),
          baked.report.rod_sag_free
              ? std::to_string(baked.report.rod_sag_free->guides) + " guides, of which " +
                    std::to_string(baked.report.rod_sag_free->too_soft) + " are too soft"
              : "\"rod\": { \"sag_free\": true } asks for them");
    stage("quantise", baked.info.packed,
          baked.info.packed ? "\"quantise\" is written" : "\"quantise\" is not written");
    out += "levels of detail\n";
    for (const LevelOfDetail& level : baked.info.levels) {
        char text[100];
        std::snprintf(text, sizeof text, "  %10u strands, drawn %.3f times as wide\n",
                      level.strand_count, double{level.width_scale});
        out += text;
    }
    out += "fields\n";
    std::uint64_t total = 0;
    for_each_field(baked.arrays.fields(), [&](const FieldDescription& field, auto values) {
        char text[200];
        std::snprintf(text, sizeof text, "  %-22.*s %12zu bytes%s\n",
                      static_cast<int>(field.name.size()), field.name.data(), values.size_bytes(),
                      values.empty() ? "  left out: not needed" : "");
        out += text;
        total += values.size_bytes();
    });
    out += "  total                  " + std::to_string(total) + " bytes\n";
    out += "recipe fields left to their defaults\n ";
    for (const std::string& name : baked.report.defaulted) out += " " + name;
    return out + "\n";
}

int fail(const Error& error) {
    std::fprintf(stderr, "keratin-bake: %s\n", to_string(error).c_str());
    return exit_code(error);
}

// What the asset says of its own accuracy.
void describe_measured(const AssetInfo& info, nlohmann::ordered_json& out) {
    if (const GuideError& error = info.guide_error; !error.method.empty()) {
        out["guide_error"] = {{"method", error.method},
                              {"mean", error.mean},
                              {"p95", error.p95},
                              {"max", error.max}};
    }
    if (info.packed) out["packed_max_error"] = info.packed_max_error;
    if (info.distance_grid.stored_bricks > 0) {
        out["distance_grid"] = {{"spacing", info.distance_grid.spacing},
                                {"max_error", info.distance_grid.max_error}};
    }
    auto& levels = out["levels"] = nlohmann::ordered_json::array();
    for (const LevelOfDetail& level : info.levels) {
        levels.push_back({{"strands", level.strand_count}, {"width_scale", level.width_scale}});
    }
}

int check(const Options& options) {
    const auto view = AssetView::open(options.check, Verify::full);
    const bool damaged = !view && view.error().code == ErrorCode::input;
    if (options.json && (view || damaged)) {
        nlohmann::ordered_json out{{"file", options.check}, {"ok", bool(view)}};
        if (view) {
            out["revision"] = {view->info().format_major, view->info().format_minor};
            out["hash"] = to_string(view->info().file_hash);
            out["strands"] = view->info().strand_count;
            out["guides"] = view->info().guide_count;
            describe_measured(view->info(), out);
        } else {
            out["message"] = to_string(view.error());
        }
        std::printf("%s\n", out.dump(2).c_str());
    }
    if (!view) {
        std::fprintf(stderr, "keratin-bake: %s\n", to_string(view.error()).c_str());
        return damaged ? kNo : exit_code(view.error());
    }
    if (!options.json && !options.quiet) {
        std::printf("%s: sound; %u strands, %u guides, hash %s\n", options.check.c_str(),
                    view->info().strand_count, view->info().guide_count,
                    to_string(view->info().file_hash).c_str());
    }
    if (auto ok = finish_stdout(); !ok) return fail(ok.error());
    return kDone;
}

// Refuses outputs that are each other or one of the files that are read.
Result<void> check_files(const Options& options, std::span<const std::string> inputs) {
    const OutputFile outputs[] = {{"-o", options.output},
                                  {"--depfile", options.depfile},
                                  {"--sarif", options.sarif},
                                  {"--export-guides", options.export_guides}};
    return check_outputs(outputs, inputs);
}

int run(const Options& options) {
    if (options.threads > 0) omp_set_num_threads(options.threads);
    if (!options.check.empty()) return check(options);
    // What can be known to be wrong before the work.
    if (auto ok = check_files(options, std::span(&options.recipe, 1)); !ok) return fail(ok.error());
    if (!options.export_guides.empty())
        if (auto ok = check_export_ending(options.export_guides); !ok) return fail(ok.error());
    auto baked = bake(options);
    if (!baked) return fail(baked.error());
    if (auto ok = check_files(options, baked->files); !ok) return fail(ok.error());
    const auto bytes = serialise_asset(baked->info, baked->arrays.fields(), options.output);
    if (!bytes) return fail(bytes.error());
    if (!options.export_guides.empty()) {
        if (auto ok = export_guides(options.export_guides, *baked); !ok) return fail(ok.error());
    }
    const auto written = write_if_changed(
        options.output, *bytes, options.keep_mtime ? Unchanged::keep_time : Unchanged::touch);
    if (!written) return fail(written.error());
    baked->report.cost = cost_so_far();
    baked->report.output_bytes = bytes->size();
    baked->report.output_changed = *written;
    if (!options.sarif.empty()) {
        const std::string sarif = report_sarif(baked->report, baked->findings, KERATIN_VERSION);
        if (auto ok = write_file(options.sarif, sarif); !ok) return fail(ok.error());
    }
    // Last: a build tool must not take a failed bake for one that is up to date.
    if (!options.depfile.empty()) {
        const std::string text = dependency_text(options.output, baked->files);
        if (auto ok = write_file(options.depfile, text); !ok) return fail(ok.error());
    }
    if (options.json) {
        std::fputs(report_json(baked->report, baked->findings).c_str(), stdout);
        if (options.explain) std::fputs(explain(*baked).c_str(), stderr);
    } else if (!options.quiet) {
        std::fputs(report_text(baked->report, baked->findings).c_str(), stdout);
        if (options.explain) std::fputs(explain(*baked).c_str(), stdout);
    }
    if (auto ok = finish_stdout(); !ok) return fail(ok.error());
    return kDone;
}

}  // namespace

int main(int argc, char** argv) {
    leave_nothing_behind();
    Options options;
    CLI::App app{
        "Bakes hair: a recipe (JSON) that names curves and a mesh becomes one asset (.kera)."};
    app.add_option("recipe", options.recipe, "Recipe to bake");
    app.add_option("-o,--output", options.output, "Asset to write (.kera)");
    app.add_option("--check", options.check,
                   "Verify this asset instead: structure, ranges, hash; exit 1 if it is damaged")
        ->type_name("FILE");
    app.add_option("--depfile", options.depfile, "Write the files read, for Make and Ninja")
        ->type_name("FILE");
    app.add_option("--threads", options.threads,
                   "Threads to use (default: all); the asset is the same for any number")
        ->check(CLI::Range(1, 1024));
    app.add_flag("--strict", options.strict,
                 "Refuse degenerate and unusable strands instead of leaving them out");
    app.add_flag("--explain", options.explain,
                 "Print what was done, what was left out and why, and the size of each field");
    app.add_option("--export-guides", options.export_guides,
                   "Write the chosen guides as curves (.abc, .hair or .obj)")
        ->type_name("FILE");
    app.add_option("--sarif", options.sarif, "Write the findings as SARIF 2.1.0")
        ->type_name("FILE");
    app.add_flag("--keep-mtime", options.keep_mtime,
                 "Leave an unchanged asset's time stamp alone (for Ninja)");
    app.add_flag("--json", options.json, "Print one JSON document (schema/report/keratin-bake.schema.json; with --check: "
                 "keratin-bake-check.schema.json)");
    app.add_flag("--quiet", options.quiet, "Print errors only");
    app.set_version_flag("--version", version_text());
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        std::fprintf(stderr, "keratin-bake: %s; see keratin-bake --help\n", error.what());
        return kWrong;
    }
    if (!options.check.empty() && !(options.recipe.empty() && options.output.empty())) {
        std::fprintf(stderr,
                     "keratin-bake: --check verifies an asset and bakes nothing; leave out the "
                     "recipe and -o\n");
        return kWrong;
    }
    if (options.check.empty() && (options.recipe.empty() || options.output.empty())) {
        std::fprintf(stderr,
                     "keratin-bake: a recipe and -o FILE are needed; see keratin-bake --help\n");
        return kWrong;
    }
    return run(options);
}
