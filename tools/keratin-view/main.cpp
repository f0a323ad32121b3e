// keratin-view: pictures of assets and cached runs.
#include "schema/asset.h"
#include "schema/cache.h"
#include "schema/files/program.h"
#include "tools/keratin-view/color.h"
#include "tools/keratin-view/draw.h"
#include "tools/keratin-view/film.h"
#include "tools/keratin-view/voxels.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <unistd.h>
#include <vector>

namespace keratin::view {
namespace {

constexpr const char* kAbout =
    "Draws an asset (.kera) or a cached run (.kcache) as a PNG picture, several frames or several "
    "of them\n"
    "as a contact sheet, the frames of one as a film.\n"
    "\n"
    "  keratin-view head.kera -o head.png                     the groom at rest\n"
    "  keratin-view run.kcache -o last.png                    the last frame of a run\n"
    "  keratin-view run.kcache -o shake.png --sheet 12        twelve frames side by side\n"
    "  keratin-view run.kcache --film shake.mp4 --samples 4   all frames (needs ffmpeg)\n"
    "  keratin-view a.kcache b.kcache -o both.png --sheet 4   a row each, seen by one camera\n"
    "  keratin-view head.kera -o guides.png --show guides,mesh --color strand\n"
    "\n"
    "The camera looks at all of the hair by itself. Real hair is thinner than a pixel, so strands "
    "are drawn\n"
    "wider where needed; the report says by how much. Exit codes: 0 done, 2 wrong usage or bad "
    "input,\n"
    "3 a fault of the program.";

struct Command {
    std::vector<std::string> inputs;
    std::string output, cache, mesh, film, camera, look_from, look_at,
        size = "800x800", show, color = "natural", hair_color = "brown", shading = "marschner",
        curves = "smooth", fit = "hair";
    double scale = 1, color_full = 0;
    float fov = 30;
    int samples = 16, threads = 0, sheet = 0, columns = 0, every = 1;
    std::optional<std::uint32_t> frame;
    std::vector<std::uint32_t> frames;
    float min_width = 1.5f;
    bool ground = false, quiet = false, json = false;
};

Error usage(const std::string& option, const std::string& message) {
    return {ErrorCode::usage, option, message};
}

Result<void> parse_size(const std::string& text, RenderSettings& settings) {
    char rest = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &settings.width, &settings.height, &rest) != 2 ||
        settings.width < 1 || settings.height < 1)
        return usage("--size", "'" + text + "' is not a size in pixels such as 800x600");
    return {};
}

Result<void> parse_show(const std::string& text, DrawOptions& options) {
    if (text.empty()) return {};
    options.show_hair = options.show_guides = options.show_mesh = options.show_colliders = false;
    std::istringstream list(text);
    for (std::string part; std::getline(list, part, ',');) {
        bool* shown = part == "hair"        ? &options.show_hair
                      : part == "guides"    ? &options.show_guides
                      : part == "mesh"      ? &options.show_mesh
                      : part == "colliders" ? &options.show_colliders
                                            : nullptr;
        if (!shown)
            return usage("--show", "'" + part + "' is not one of hair, guides, mesh, colliders");
        *shown = true;
    }
    return {};
}

Result<DrawOptions> draw_options(const Command& command) {
    DrawOptions options;
    if (const auto ok = parse_size(command.size, options.render); !ok) return ok.error();
    options.render.samples = command.samples;
    options.render.threads = command.threads;
    options.render.ground = command.ground;
    options.min_pixels = command.min_width;
    if (const auto ok = parse_show(command.show, options); !ok) return ok.error();
    const auto hair_color = parse_hair_color(command.hair_color);
    if (!hair_color) return usage("--hair-color", hair_color.error().message);
    options.hair_color = *hair_color;
    constexpr std::string_view texture = "texture=";
    if (command.color.starts_with(texture)) {
        auto image = read_image(command.color.substr(texture.size()));
        if (!image) return image.error();
        options.texture = std::move(*image);
        options.coloring = HairColoring::texture;
    } else if (command.color == "strand") {
        options.coloring = HairColoring::strand;
    } else if (command.color == "density") {
        options.coloring = HairColoring::density;
    } else if (command.color == "velocity") {
        options.coloring = HairColoring::velocity;
    } else if (command.color != "natural") {
        return usage("--color",
                     "'" + command.color +
                         "' is not one of natural, strand, density, velocity, texture=FILE");
    }
    options.shading = command.shading == "kajiya" ? HairShading::kajiya
                      : command.shading == "flat" ? HairShading::flat
                                                  : HairShading::marschner;
    options.shape = command.curves == "straight" ? CurveShape::straight : CurveShape::smooth;
    return options;
}

// An asset or run, and its frames to draw by their place in the run.
struct Chosen {
    Source source;
    std::vector<std::size_t> places;
};

// Frames to draw, by their place in the run.
Result<std::vector<std::size_t>> chosen_frames(const Command& command, const Source& source) {
    const std::size_t count = frame_count(source);
    if (count == 0) return Error{ErrorCode::input, source.name, "holds no frames"};
    const bool any =
        command.frame || !command.frames.empty() || command.sheet > 0 || !command.film.empty();
    if (any && !source.cache)
        return usage("--frame", source.name +
                                    " is an asset at rest; frames come from a cached run "
                                    "(keratin-run --cache run.kcache)");
    std::vector<std::size_t> places;
    std::vector<std::uint32_t> wanted = command.frames;
    if (command.frame) wanted.push_back(*command.frame);
    for (const std::uint32_t frame : wanted) {
        if (frame >= count)
            return Error{ErrorCode::input, source.name,
                         "has the frames 0 to " + std::to_string(count - 1) + ", not " +
                             std::to_string(frame)};
        places.push_back(frame);
    }
    if (!places.empty()) return places;
    if (command.sheet > 0) {
        const std::size_t n = std::min(count, std::size_t(command.sheet));
        for (std::size_t i = 0; i < n; ++i)
            places.push_back(n > 1 ? i * (count - 1) / (n - 1) : count - 1);
    } else if (!command.film.empty()) {
        for (std::size_t i = 0; i < count; i += std::size_t(command.every)) places.push_back(i);
    } else {
        places.push_back(count - 1);
    }
    return places;
}

Result<std::vector<Chosen>> chosen_inputs(const Command& command) {
    if (command.inputs.size() > 1 && !command.cache.empty())
        return usage("--cache", "goes with one asset, not with " +
                                    std::to_string(command.inputs.size()) +
                                    " inputs; a cached run by itself is an input, too");
    if (command.inputs.size() > 1 && !command.film.empty())
        return usage("--film",
                     "shows one run, not " + std::to_string(command.inputs.size()) + " inputs");
    std::vector<Chosen> chosen;
    for (const std::string& input : command.inputs) {
        auto source = open_source(input, command.cache);
        if (!source) return source.error();
        if (!command.mesh.empty()) {
            auto body = read_body(command.mesh, command.scale);
            if (!body) return body.error();
            source->body = std::move(*body);
        }
        auto places = chosen_frames(command, *source);
        if (!places) return places.error();
        chosen.push_back({std::move(*source), std::move(*places)});
    }
    return chosen;
}

// Pictures in a row of the contact sheet; 0: so many that it is about as wide as high.
int sheet_columns(const Command& command, const std::vector<Chosen>& chosen) {
    if (command.columns > 0 || chosen.size() == 1) return command.columns;
    const std::size_t frames = chosen[0].places.size();
    const bool rows = frames > 1 && std::all_of(chosen.begin(), chosen.end(), [&](const Chosen& c) {
                          return c.places.size() == frames;
                      });
    return rows ? int(frames) : 0;
}

// What stands in a picture among several.
std::string caption_of(const Chosen& chosen, const Subject& subject, bool named) {
    std::string caption =
        named ? std::filesystem::path(chosen.source.name).stem().string() + "  " : "";
    if (chosen.source.cache) {
        char text[64];
        std::snprintf(text, sizeof text, "frame %u  %.2f s", subject.frame, subject.time);
        caption += text;
    }
    return caption;
}

// The camera of the command line, or nothing where it is to be framed.
Result<std::optional<Camera>> given_camera(const Command& command) {
    if (command.look_from.empty()) return std::optional<Camera>();
    Camera camera;
    camera.fov_deg = command.fov;
    const auto from = parse_point(command.look_from);
    if (!from) return usage("--look-from", from.error().message);
    camera.position = *from;
    const auto at =
        command.look_at.empty() ? Result<Float3>(Float3{}) : parse_point(command.look_at);
    if (!at) return usage("--look-at", at.error().message);
    camera.target = *at;
    if (*from == *at) return usage("--look-at", "is the same point as --look-from");
    return std::optional<Camera>(camera);
}

// The frame with all that its colours need.
Result<Subject> subject_to_draw(const Source& source, std::size_t place, HairColoring coloring) {
    auto subject = subject_at(source, place);
    if (subject && (coloring == HairColoring::density || coloring == HairColoring::velocity))
        if (const auto ok = add_voxel_values(source, place, *subject); !ok) return ok.error();
    return subject;
}

class Progress {
  public:
    explicit Progress(bool wanted) : wanted_(wanted && isatty(STDERR_FILENO)) {}
    ~Progress() { clear(); }
    void at(std::size_t done, std::size_t all) {
        if (!wanted_ || std::chrono::steady_clock::now() - start_ < std::chrono::seconds(1)) return;
        std::fprintf(stderr, "\rframe %zu of %zu ", done, all);
        shown_ = true;
    }

  private:
    void clear() {
        if (shown_) std::fprintf(stderr, "\r%40s\r", "");
    }
    bool wanted_, shown_ = false;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

nlohmann::ordered_json array_of(Float3 v) { return {v.x, v.y, v.z}; }

Result<void> view(const Command& command) {
    const auto start = std::chrono::steady_clock::now();
    auto chosen_options = draw_options(command);
    if (!chosen_options) return chosen_options.error();
    DrawOptions& options = *chosen_options;
    const auto chosen = chosen_inputs(command);
    if (!chosen) return chosen.error();
    const bool several = chosen->size() > 1;
    std::size_t count = 0;
    for (const Chosen& c : *chosen) count += c.places.size();

    const auto given = given_camera(command);
    if (!given) return given.error();
    ViewAngles angles;
    if (!command.camera.empty()) {
        const auto parsed = parse_view_angles(command.camera);
        if (!parsed) return parsed.error();
        angles = *parsed;
    }

    // One camera and one scale of colours for all pictures.
    Framing framing(angles, options.render.width, options.render.height, command.fov);
    double full = command.color_full;
    for (const Chosen& c : *chosen)
        for (const std::size_t place : c.places) {
            const auto subject = subject_to_draw(c.source, place, options.coloring);
            if (!subject) return subject.error();
            include_shown(*subject, options, command.fit == "all", framing);
            if (command.color_full == 0)
                full = std::max(full, double(usual_largest(*subject, options.coloring)));
        }
    options.color_full = full > 0 ? float(full) : 1;
    const Camera camera = *given ? **given : framing.camera();

    std::optional<Film> film;
    if (!command.film.empty()) {
        const double seconds = chosen->front().source.cache->head().frame * command.every;
        auto created = Film::create(command.film, options.render.width, options.render.height,
                                    seconds > 0 ? 1 / seconds : 30);
        if (!created) return created.error();
        film.emplace(std::move(*created));
    }
    const bool keep = !command.output.empty();
    std::vector<Image> pictures;
    nlohmann::ordered_json frames = nlohmann::ordered_json::array();
    Drawn last;
    Progress progress(!command.quiet && !command.json);
    for (const Chosen& c : *chosen)
        for (const std::size_t place : c.places) {
            progress.at(pictures.size() + 1, count);
            const auto subject = subject_to_draw(c.source, place, options.coloring);
            if (!subject) return subject.error();
            if (count > 1) options.caption = caption_of(c, *subject, several);
            auto drawn = draw(*subject, camera, options);
            if (!drawn) return drawn.error();
            if (film)
                if (const auto ok = film->add(drawn->image); !ok) return ok.error();
            if (c.source.cache) {
                frames.push_back({{"frame", subject->frame}, {"time", subject->time}});
                if (several) frames.back()["input"] = c.source.name;
            }
            if (keep) pictures.push_back(drawn->image);
            last = std::move(*drawn);
        }
    if (keep) {
        const Image image = pictures.size() == 1
                                ? pictures[0]
                                : contact_sheet(pictures, sheet_columns(command, *chosen));
        if (const auto ok = write_png(image, command.output); !ok) return ok.error();
    }
    if (film)
        if (const auto ok = film->finish(); !ok) return ok.error();

    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const bool scaled =
        options.coloring == HairColoring::density || options.coloring == HairColoring::velocity;
    if (command.json) {
        nlohmann::ordered_json document = {{"program", "keratin-view"},
                                           {"version", KERATIN_VERSION},
                                           {"input", command.inputs[0]}};
        if (several) document["inputs"] = command.inputs;
        if (keep) document["output"] = command.output;
        if (!command.film.empty()) document["film"] = command.film;
        document["width"] = options.render.width;
        document["height"] = options.render.height;
        document["samples"] = options.render.samples;
        document["camera"] = {{"position", array_of(camera.position)},
                              {"target", array_of(camera.target)},
                              {"fov_deg", camera.fov_deg}};
        document["frames"] = frames;
        document["strands"] = last.strands;
        document["points"] = last.points;
        document["guides"] = last.guides;
        document["triangles"] = last.triangles;
        document["min_width_pixels"] = options.min_pixels;
        document["widened_points"] = last.widened_points;
        document["largest_widening"] = last.largest_widening;
        if (scaled) document["color_full"] = options.color_full;
        document["seconds"] = seconds;
        std::printf("%s\n", document.dump(2).c_str());
    } else if (!command.quiet) {
        std::string to = command.output;
        if (film) to += (to.empty() ? "" : " and ") + command.film;
        std::printf(
            "%s: %zu strands, %zu guides, %zu triangles, %zu picture%s of %dx%d in %.1f s\n",
            to.c_str(), last.strands, last.guides, last.triangles, count, count == 1 ? "" : "s",
            options.render.width, options.render.height, seconds);
        if (last.widened_points > 0)
            std::printf("strands are drawn %.3g pixels wide, up to %.1f times their own width\n",
                        options.min_pixels, last.largest_widening);
        if (scaled)
            std::printf("brightest colour: %.3g %s\n", options.color_full,
                        options.coloring == HairColoring::velocity ? "m/s" : "density");
    }
    return {};
}

int run(int argc, char** argv) {
    Command command;
    CLI::App app{kAbout, "keratin-view"};
    app.set_version_flag("--version",
                         "keratin-view " KERATIN_VERSION ", assets of revision " +
                             std::to_string(kAssetMajor) + "." + std::to_string(kAssetMinor) +
                             ", cached runs of revision " + std::to_string(kCacheMajor) + "." +
                             std::to_string(kCacheMinor));
    app.add_option(
           "input", command.inputs,
           "asset (.kera) or cached run (.kcache); several: a contact sheet, named by their "
           "files")
        ->required()
        ->type_name("FILE");
    app.add_option("-o,--output", command.output,
                   "PNG to write; with several frames or inputs a contact sheet")
        ->type_name("FILE");
    app.add_option("--cache", command.cache, "cached run of the asset")
        ->type_name("FILE")
        ->group("What");
    app.add_option("--frame", command.frame, "one frame of the run, 0 the first; default: the last")
        ->group("What");
    app.add_option("--frames", command.frames, "several frames: 0,30,60")
        ->delimiter(',')
        ->group("What");
    app.add_option("--sheet", command.sheet, "that many frames, evenly spread over the run")
        ->check(CLI::Range(1, 400))
        ->group("What");
    app.add_option("--columns", command.columns,
                   "pictures in a row of the contact sheet; default: a row an input where all have "
                   "the same number of frames, otherwise about as wide as high")
        ->check(CLI::Range(1, 400))
        ->group("What");
    app.add_option("--film", command.film, "all frames as a film (mp4, webm, gif; needs ffmpeg)")
        ->type_name("FILE")
        ->group("What");
    app.add_option("--every", command.every, "film: only each n-th frame")
        ->check(CLI::Range(1, 1000))
        ->group("What");
    app.add_option("--mesh", command.mesh,
                   "body from a mesh file, instead of what the asset stores")
        ->type_name("FILE")
        ->group("What");
    app.add_option("--scale", command.scale,
                   "metres a unit of the --mesh file, as in the groom's recipe")
        ->check(number_between(1e-9, 1e9))
        ->capture_default_str()
        ->group("What");
    app.add_option("--show", command.show,
                   "hair, guides, mesh, colliders, with commas; default hair,mesh")
        ->type_name("PARTS")
        ->group("What");

    app.add_option("--camera", command.camera,
                   "yaw,pitch[,distance]: degrees around and above (yaw 0 looks from +z, 90 from "
                   "+x), metres; default 35,8, near enough to see all hair")
        ->type_name("YAW,PITCH[,M]")
        ->group("Camera");
    app.add_option("--look-from", command.look_from, "position of the camera, m")
        ->type_name("X,Y,Z")
        ->group("Camera");
    app.add_option("--look-at", command.look_at,
                   "point in the middle of the picture, m; default 0,0,0")
        ->type_name("X,Y,Z")
        ->needs("--look-from")
        ->group("Camera");
    app.add_option("--fov", command.fov, "angle of view from bottom to top, degrees")
        ->check(number_between(1, 120))
        ->capture_default_str()
        ->group("Camera");
    app.add_option("--fit", command.fit,
                   "what the automatic camera sees: hair, or all (the mesh too)")
        ->check(CLI::IsMember({"hair", "all"}))
        ->capture_default_str()
        ->group("Camera");
    app.add_option("--size", command.size, "pixels")
        ->type_name("WxH")
        ->capture_default_str()
        ->group("Camera");
    app.add_option("--samples", command.samples, "rays a pixel: 4 quick, 16 good, 64 fine")
        ->check(CLI::Range(1, 4096))
        ->capture_default_str()
        ->group("Camera");

    app.add_option(
           "--color", command.color,
           "natural; strand: one colour a strand; density, velocity: of the hair on a grid; "
           "texture=FILE: at the roots' uv")
        ->capture_default_str()
        ->group("Looks");
    app.add_option(
           "--color-full", command.color_full,
           "density or velocity (m/s) of the brightest colour; default: what 98 % stay under")
        ->check(number_between(1e-9, 1e9))
        ->group("Looks");
    app.add_option("--hair-color", command.hair_color,
                   "black, dark, brown, auburn, red, blond, grey, white or #rrggbb")
        ->capture_default_str()
        ->group("Looks");
    app.add_option("--shading", command.shading, "marschner: as hair looks; kajiya: simpler; flat")
        ->check(CLI::IsMember({"marschner", "kajiya", "flat"}))
        ->capture_default_str()
        ->group("Looks");
    app.add_option("--curves", command.curves,
                   "smooth splines, or the straight segments that are simulated")
        ->check(CLI::IsMember({"smooth", "straight"}))
        ->capture_default_str()
        ->group("Looks");
    app.add_option("--min-width", command.min_width,
                   "pixels that a strand is wide at least; 0: its own width")
        ->check(number_between(0, 100))
        ->capture_default_str()
        ->group("Looks");
    app.add_flag("--ground", command.ground, "a floor with shadows under the lowest point")
        ->group("Looks");

    app.add_option("--threads", command.threads, "default: all")->check(CLI::Range(1, 1024));
    app.add_flag("--json", command.json,
                 "one JSON document on stdout (schema/report/keratin-view.schema.json)");
    app.add_flag("--quiet", command.quiet, "no messages but errors");
    app.get_formatter()->column_width(28);
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::CallForVersion& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        std::cerr << "keratin-view: " << e.what() << " (keratin-view --help explains)\n";
        return 2;
    }
    const OutputFile outputs[] = {{"-o", command.output}, {"--film", command.film}};
    std::vector<std::string> inputs = command.inputs;
    inputs.insert(inputs.end(), {command.cache, command.mesh});
    Result<void> done =
        command.output.empty() && command.film.empty()
            ? Result<void>(usage("-o", "give the picture a name, such as -o head.png"))
            : check_outputs(outputs, inputs);
    if (done) done = view(command);
    if (done) done = finish_stdout();
    if (done) return 0;
    std::cerr << "keratin-view: " << to_string(done.error()) << '\n';
    return exit_code(done.error());
}

}  // namespace
}  // namespace keratin::view

int main(int argc, char** argv) {
    keratin::leave_nothing_behind();
    try {
        return keratin::view::run(argc, argv);
    } catch (const std::exception& e) {
        std::cerr << "keratin-view: internal fault: " << e.what() << '\n';
        return 3;
    }
}
