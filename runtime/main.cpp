// keratin-run: runs a solver on a scene or an asset and writes what was asked for.
#include "runtime/export/strand_export.h"
#include "runtime/run/motion.h"
#include "runtime/run/points_csv.h"
#include "runtime/run/solver_run.h"
#include "runtime/run/state_file.h"
#include "runtime/run/statistics.h"
#include "schema/cache.h"
#include "schema/files/program.h"
#include "schema/files/write_file.h"
#include "schema/read/scene.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <unistd.h>

using namespace keratin;

namespace {

constexpr int kDone = 0, kNo = 1, kWrong = 2, kFault = 3;
constexpr double kDefaultDuration = 1;  // s, of a scene that does not say
// s: largest step where rods can meet and nothing else is said. In a frame's step they pass through
// each other's middles, and all of it at once has no answer.
constexpr double kContactStep = 1e-3;

struct Options {
    std::string input, solver, backend = "auto", precision;
    std::string stats, points, cache, export_file, save, resume;
    int threads = 0;
    std::uint64_t frames = 0, every = 1;
    std::optional<double> duration, frame, step;
    bool final_state = false, convergence = false, soften = false, explain = false;
    bool json = false, quiet = false;

    bool writes() const {
        return !stats.empty() || !points.empty() || !cache.empty() || !export_file.empty() ||
               !save.empty();
    }
    bool measures() const { return !stats.empty() || (json && (!explain || writes())); }
};

std::string version_text() {
    return "keratin-run " KERATIN_VERSION ", asset revision " + std::to_string(kAssetMajor) + "." +
           std::to_string(kAssetMinor) + ", cache revision " + std::to_string(kCacheMajor) + "." +
           std::to_string(kCacheMinor);
}

void add_options(CLI::App& app, Options& o) {
    app.set_version_flag("--version", version_text(), "Print version and format revisions");
    app.add_option("input", o.input, "Scene (.json) or baked asset (.kera)")->required();
    app.add_option("--solver", o.solver,
                   "strand, rod, cosserat or superhelix; default: the scene's")
        ->type_name("NAME");
    app.add_option("--backend", o.backend, "cpu, vulkan or auto")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("--precision", o.precision, "float or double; default: the solver's own")
        ->type_name("NAME");
    app.add_option("--threads", o.threads, "Threads to compute with; default: one a processor")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    auto* frames = app.add_option("--frames", o.frames, "Length of the run in frames")
                       ->check(CLI::Range(1, 1000000000))
                       ->type_name("N");
    app.add_option("--duration", o.duration,
                   "Length of the run in seconds; default: the scene's, or 1")
        ->check(number_between(1e-9, 1e9))
        ->excludes(frames)
        ->type_name("S");
    app.add_option("--frame", o.frame, "Seconds between outputs; default: the scene's, or 1/60")
        ->check(number_between(1e-9, 1e6))
        ->type_name("S");
    app.add_option(
           "--step", o.step,
           "Largest step in seconds; default: the scene's, or one a frame, or 0.001 where rods "
           "can meet others or colliders")
        ->check(number_between(1e-9, 1e6))
        ->type_name("S");
    app.add_option("--stats", o.stats,
                   "Measure the run and write the figures as JSON (- for stdout)")
        ->type_name("FILE");
    app.add_flag("--final", o.final_state, "Add the final positions and velocities to the figures");
    app.add_flag("--convergence", o.convergence,
                 "Add what each iteration of the last step changed (rod)");
    auto* points = app.add_option("--points", o.points, "Write the simulated points as CSV")
                       ->type_name("FILE");
    app.add_option("--every", o.every, "With --points: only every N-th frame")
        ->needs(points)
        ->check(CLI::Range(1, 1000000000))
        ->type_name("N");
    app.add_option("--cache", o.cache,
                   "Write every frame for keratin-view and keratin-diff (.kcache)")
        ->type_name("FILE");
    app.add_option("--export", o.export_file,
                   "Write the render strands: .abc, or .hair or .obj a frame")
        ->type_name("FILE");
    app.add_option("--save", o.save, "Write the state at the end, to go on from later")
        ->type_name("FILE");
    app.add_option("--resume", o.resume, "Go on from a state that --save wrote")->type_name("FILE");
    app.add_flag("--soften", o.soften, "Soften what would need too small a step (cosserat)");
    app.add_flag(
        "--explain", o.explain,
        "Print what runs, what it takes and what is left out, with reasons; runs only if an "
        "output is asked for");
    app.add_flag("--json", o.json, "Print the figures as one JSON document on stdout");
    app.add_flag("--quiet", o.quiet, "Print nothing but errors");
    app.footer(
        "Exit codes: 0 done, 1 the result is not finite, 2 wrong usage or bad input, 3 internal "
        "fault.\nA run of a head with its motion: keratin-run shake.json --stats stats.json "
        "--cache run.kcache");
}

Error usage(const std::string& where, const std::string& message) {
    return {ErrorCode::usage, where, message};
}

// What contradicts itself or asks for what this build or solver does not do.
Result<void> check_options(const Options& o, SolverKind solver) {
    const std::string word(solver_word(solver));
    if (o.backend != "cpu" && o.backend != "auto" && o.backend != "vulkan")
        return usage("--backend", "expected cpu, vulkan or auto but found " + o.backend);
    if (o.backend == "vulkan")
        return Error{ErrorCode::unsupported, "--backend",
                     "this build has no Vulkan backend; use cpu"};
    const std::string precision = solver == SolverKind::strand ? "float" : "double";
    if (!o.precision.empty() && o.precision != "float" && o.precision != "double")
        return usage("--precision", "expected float or double but found " + o.precision);
    if (!o.precision.empty() && o.precision != precision)
        return Error{ErrorCode::unsupported, "--precision",
                     "the " + word + " solver computes in " + precision + " only"};
    if (o.soften && solver != SolverKind::cosserat)
        return Error{ErrorCode::unsupported, "--soften", "belongs to the cosserat solver"};
    if ((o.final_state || o.convergence) && o.stats.empty() && !o.json)
        return usage(o.final_state ? "--final" : "--convergence",
                     "adds to the figures; write --stats FILE or --json too");
    if (o.json && o.stats == "-")
        return usage("--stats", "writes to stdout as --json does; leave one of them out");
    return {};
}

bool rods_can_meet(const Scene& scene) {
    return scene.solver == SolverKind::rod && scene.settings.contact != "none" &&
           (scene.strands.size() > 1 || !scene.assets.empty() || !scene.colliders.empty());
}

Result<Scene> scene_of(const Options& o) {
    std::optional<SolverKind> solver;
    if (!o.solver.empty()) {
        solver = solver_of_word(o.solver);
        if (!solver)
            return usage("--solver",
                         "expected strand, rod, cosserat or superhelix but found " + o.solver);
    }
    Scene scene;
    if (o.input.size() > 5 && o.input.compare(o.input.size() - 5, 5, ".kera") == 0) {
        scene.file = o.input;
        scene.solver = solver.value_or(SolverKind::strand);
        scene.assets.push_back({});
        scene.assets.back().file = o.input;
    } else {
        auto read = read_scene(o.input, solver);
        if (!read) return read.error();
        scene = std::move(*read);
    }
    if (o.frame) scene.frame = *o.frame;
    if (o.step) scene.step = *o.step;
    if (!scene.step && rods_can_meet(scene)) scene.step = std::min(scene.frame, kContactStep);
    if (o.duration) scene.duration = *o.duration;
    return scene;
}

Result<std::unique_ptr<SolverRun>> make_run(const Scene& scene, const Options& o) {
    const RunOptions options{KERATIN_VERSION, o.threads, o.convergence};
    switch (scene.solver) {
        case SolverKind::strand:
            return make_strand_run(scene, options);
#ifdef KERATIN_WITH_ROD
        case SolverKind::rod:
            return make_rod_run(scene, options);
#endif
        default:
            break;
    }
    return Error{ErrorCode::unsupported, scene.file,
                 "this build has no " + std::string(solver_word(scene.solver)) + " solver"};
}

// Shows how far a run is, on stderr, when that is a terminal and the run takes long.
class Progress {
  public:
    explicit Progress(bool show) : show_(show && isatty(STDERR_FILENO)) {}
    ~Progress() {
        if (shown_) std::fprintf(stderr, "\r\033[K");
    }
    void at(std::uint64_t done, std::uint64_t all) {
        if (!show_) return;
        const auto now = std::chrono::steady_clock::now();
        if (now - start_ < std::chrono::seconds(1) || now - last_ < std::chrono::milliseconds(100))
            return;
        last_ = now;
        shown_ = true;
        constexpr int kWidth = 20;
        const int filled = static_cast<int>(done * kWidth / all);
        std::fprintf(stderr, "\r\033[K[%s%s] step %llu of %llu", std::string(filled, '#').c_str(),
                     std::string(kWidth - filled, '.').c_str(),
                     static_cast<unsigned long long>(done), static_cast<unsigned long long>(all));
    }

  private:
    bool show_, shown_ = false;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_;
};

// Everything a run writes while it goes on.
struct Outputs {
    std::optional<CacheWriter> cache;
    std::optional<PointsCsv> points;
    std::unique_ptr<StrandExporter> exporter;
    std::unique_ptr<Statistics> statistics;
    std::uint64_t every = 1;

    static Result<Outputs> open(const Options& o, const Scene& scene, const SolverRun& run,
                                const Schedule& schedule);
    bool any() const { return cache || points || exporter || statistics; }
    Result<void> frame(std::uint64_t number, double time, const SolverRun& run,
                       const RunState& state);
    Result<void> finish();
};

Result<Outputs> Outputs::open(const Options& o, const Scene& scene, const SolverRun& run,
                              const Schedule& schedule) {
    Outputs out;
    out.every = o.every;
    const RunLayout& layout = run.layout();
    if (!o.cache.empty()) {
        auto writer = CacheWriter::create(o.cache, layout.head);
        if (!writer) return writer.error();
        out.cache = std::move(*writer);
    }
    if (!o.points.empty()) {
        auto points = PointsCsv::create(o.points);
        if (!points) return points.error();
        out.points = std::move(*points);
    }
    if (!o.export_file.empty()) {
        auto exporter = StrandExporter::create(
            o.export_file,
            {layout.head.strand_first_point, layout.head.strand_radius, layout.uv, layout.id, {}},
            scene.frame, static_cast<std::uint32_t>(schedule.frame_count() + 1));
        if (!exporter) return exporter.error();
        out.exporter = std::move(*exporter);
    }
    if (o.measures()) {
        auto statistics = Statistics::create(scene, run);
        if (!statistics) return statistics.error();
        out.statistics = std::move(*statistics);
    }
    return out;
}

Result<void> Outputs::frame(std::uint64_t number, double time, const SolverRun& run,
                            const RunState& state) {
    if (statistics) statistics->add_frame(time, state);
    if (points && number % every == 0)
        if (auto ok = points->add(number, time, run.layout(), state); !ok) return ok;
    if (exporter)
        if (auto ok = exporter->add(state.strand_position); !ok) return ok;
    if (!cache) return {};
    CacheFrame out;
    out.number = static_cast<std::uint32_t>(number);
    out.time = time;
    for (const measure::Point& p : state.position)
        for (const double c : {p.x, p.y, p.z}) out.guide_position.push_back(static_cast<float>(c));
    out.strand_position = state.strand_position;
    out.bodies = state.bodies;
    out.colliders = state.colliders;
    return cache->write(out);
}

Result<void> Outputs::finish() {
    if (points)
        if (auto ok = points->finish(); !ok) return ok;
    if (exporter)
        if (auto ok = exporter->finish(); !ok) return ok;
    if (cache) return cache->finish();
    return {};
}

bool is_finite(const RunState& state) {
    for (const measure::Point& p : state.position)
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
    for (const float x : state.strand_position)
        if (!std::isfinite(x)) return false;
    return true;
}

Result<std::uint64_t> resume(const Options& o, SolverRun& run, const Schedule& schedule) {
    auto saved = load_run(o.resume, run.layout());
    if (!saved) return saved.error();
    if (saved->steps_per_frame != schedule.steps_per_frame || saved->frame != schedule.frame)
        return Error{ErrorCode::input, o.resume,
                     "was saved from a run with other frames or steps; use the same --frame and "
                     "--step"};
    if (saved->steps >= schedule.step_count)
        return Error{ErrorCode::input, o.resume,
                     "the saved run is at step " + std::to_string(saved->steps) +
                         " already; --frames and --duration count from the run's beginning"};
    if (auto ok = run.load(saved->state, schedule.time(saved->steps)); !ok)
        return Error{ok.error().code, o.resume, ok.error().message};
    return saved->steps;
}

void print_summary(const Schedule& schedule, std::uint64_t steps, const SolverRun& run,
                   double seconds) {
    const RunLayout& layout = run.layout();
    std::printf("%s: %zu simulated strands, %zu points, %zu render strands\n",
                layout.head.solver.c_str(), layout.head.guide_lane.size(), layout.rest.size(),
                layout.head.strand_radius.size());
    std::printf("%llu steps of %.6g s in %.3g s; final state %s\n",
                static_cast<unsigned long long>(steps),
                schedule.frame / static_cast<double>(schedule.steps_per_frame), seconds,
                run.hash().c_str());
}

// Refuses outputs that are each other or one of the files that are read; --save may go on where
// --resume was.
Result<void> check_files(const Options& o, const Scene& scene) {
    std::vector<std::string> inputs = {o.input};
    for (const SceneAsset& asset : scene.assets) {
        inputs.push_back(asset.file);
        for (const MeshFrame& frame : asset.mesh_frames) inputs.push_back(frame.file);
    }
    const OutputFile outputs[] = {{"--stats", o.stats == "-" ? "" : o.stats},
                                  {"--points", o.points},
                                  {"--cache", o.cache},
                                  {"--export", o.export_file},
                                  {"--save", o.save}};
    return check_outputs(outputs, inputs);
}

// Steps must be countable, and exactly so in the double precision of their times.
Result<void> check_length(const Options& o, const Scene& scene) {
    constexpr double kMostSteps = 9007199254740992.0;  // 2^53
    const double step = scene.step.value_or(scene.frame);
    const double frames = o.frames > 0 ? static_cast<double>(o.frames)
                                       : scene.duration.value_or(kDefaultDuration) / scene.frame;
    const double steps = frames * std::max(1.0, scene.frame / step);
    if (steps < kMostSteps) return {};
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", steps);
    return usage(scene.file, std::string("the run would take ") + text +
                                 " steps; make it shorter or its steps longer");
}

Result<int> run_scene(const Options& o) {
    auto scene = scene_of(o);
    if (!scene) return scene.error();
    if (auto ok = check_files(o, *scene); !ok) return ok.error();
    if (auto ok = check_options(o, scene->solver); !ok) return ok.error();
    auto made = make_run(*scene, o);
    if (!made) return made.error();
    SolverRun& run = **made;
    if (o.explain && !o.json) std::fputs(run.explain().c_str(), stdout);
    if (o.explain && !o.writes()) {
        if (o.json) {
            nlohmann::ordered_json plan;
            run.plan(plan["plan"]);
            std::printf("%s\n", plan.dump(2).c_str());
        }
        return kDone;
    }

    if (auto ok = check_length(o, *scene); !ok) return ok.error();
    const Schedule schedule = make_schedule(scene->frame, scene->step.value_or(0), o.frames,
                                            scene->duration.value_or(kDefaultDuration));
    std::uint64_t first = 0;
    if (!o.resume.empty()) {
        auto steps = resume(o, run, schedule);
        if (!steps) return steps.error();
        first = *steps;
    }
    auto outputs = Outputs::open(o, *scene, run, schedule);
    if (!outputs) return outputs.error();

    RunState state;
    if (first == 0 && outputs->any()) {
        run.look(state);
        if (auto ok = outputs->frame(0, 0, run, state); !ok) return ok.error();
    }
    double seconds = 0;
    {
        Progress progress(!o.quiet);
        for (std::uint64_t k = first; k < schedule.step_count; ++k) {
            const auto begin = std::chrono::steady_clock::now();
            if (auto ok = run.step(schedule.time(k), schedule.time(k + 1)); !ok) return ok.error();
            seconds +=
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            progress.at(k + 1, schedule.step_count);
            if (!schedule.ends_frame(k) || !outputs->any()) continue;
            run.look(state);
            if (auto ok = outputs->frame((k + 1) / schedule.steps_per_frame, schedule.time(k + 1),
                                         run, state);
                !ok)
                return ok.error();
        }
    }
    run.look(state);
    if (auto ok = outputs->finish(); !ok) return ok.error();
    if (!o.save.empty()) {
        auto solver_state = run.save();
        if (!solver_state) return solver_state.error();
        if (auto ok = save_run(o.save,
                               {schedule.step_count, schedule.steps_per_frame, schedule.frame,
                                std::move(*solver_state)},
                               run.layout());
            !ok)
            return ok.error();
    }
    if (outputs->statistics) {
        if (!schedule.ends_frame(schedule.step_count - 1))
            outputs->statistics->add_frame(schedule.time(schedule.step_count), state);
        const int threads =
            o.threads ? o.threads : static_cast<int>(std::thread::hardware_concurrency());
        auto document = outputs->statistics->document(run, schedule, threads);
        document["steps"] = schedule.step_count - first;
        if (o.final_state) {
            const auto& points = run.layout().head.guide_first_point;
            document["final"] = points_by_strand(points, state.position);
            document["final_velocity"] = points_by_strand(points, state.velocity);
        }
        if (o.explain) run.plan(document["plan"]);
        const std::string text = document.dump(2) + "\n";
        if (o.json || o.stats == "-") std::fputs(text.c_str(), stdout);
        if (!o.stats.empty() && o.stats != "-")
            if (auto ok = write_file(o.stats, text); !ok) return ok.error();
    }
    if (!o.quiet && !o.json && o.stats != "-")
        print_summary(schedule, schedule.step_count - first, run, seconds);
    if (is_finite(state)) return kDone;
    std::fprintf(stderr,
                 "keratin-run: %s: the strands are not finite any more; use smaller steps\n",
                 scene->file.c_str());
    return kNo;
}

}  // namespace

int main(int argc, char** argv) try {
    wait_sleeping(argv);
    leave_nothing_behind();
    Options options;
    CLI::App app("Runs a hair solver on a scene or a baked asset.", "keratin-run");
    add_options(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& success) {
        return app.exit(success);
    } catch (const CLI::ParseError& error) {
        std::fprintf(stderr, "keratin-run: %s; keratin-run --help lists all options\n",
                     error.what());
        return kWrong;
    }
    auto result = run_scene(options);
    if (result)
        if (auto ok = finish_stdout(); !ok) result = ok.error();
    if (result) return *result;
    std::fprintf(stderr, "keratin-run: %s\n", to_string(result.error()).c_str());
    return exit_code(result.error());
} catch (const std::exception& fault) {
    std::fprintf(stderr, "keratin-run: internal fault: %s\n", fault.what());
    return kFault;
}
