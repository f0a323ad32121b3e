// Writes the contact scenes of contact_scenes.h as scene files that keratin-run runs:
//
//     keratin-contact-scenes FOLDER            all but the hairball (data/scenes keeps them)
//     keratin-contact-scenes FOLDER NAME...    those named
//
// The hairball's file takes 20 MB and more; it is written where it is needed.
#include "tools/scenes/contact_scenes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

using namespace keratin;
using namespace keratin::scenes;

namespace {

// The shortest text that reads back as the same number, of numbers rounded to a nanometre or less.
std::string number(double x) {
    const double rounded = std::round(x * 1e9) / 1e9;
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, rounded + 0.0).ptr;
    return std::string(text, end);
}
std::string triple(double x, double y, double z) {
    return "[" + number(x) + ", " + number(y) + ", " + number(z) + "]";
}
std::string triple(const Double3& p) { return triple(p[0], p[1], p[2]); }
std::string triple(const Vector3& p) { return triple(p.x, p.y, p.z); }

const char* end_name(RodEnd end) {
    switch (end) {
        case RodEnd::free:
            return "free";
        case RodEnd::pinned:
            return "pinned";
        case RodEnd::clamped:
            return "clamped";
        case RodEnd::clamped_two_points:
            return "clamped_two_points";
    }
    return "free";
}

// The turn about y of a hairball, as keyframes that leave no more than 1e-5 of the radius between
// them and the smooth motion.
std::string turn_of_hairball(double duration) {
    constexpr double kFrame = 0.02;  // s
    std::string out = "\"motion\": [";
    for (int k = 0; k * kFrame <= duration + 1e-9; ++k) {
        const double t = k * kFrame, half = 0.5 * hairball_angle(t);
        if (k > 0) out += ", ";
        out += "{\"time\": " + number(t) + ", \"rotation\": [0, " + number(std::sin(half)) +
               ", 0, " + number(std::cos(half)) + "]}";
    }
    return out + "]";
}

std::string collider_text(const ContactCollider& c, const std::string& motion) {
    const RigidShape& s = c.shape;
    std::string out = "    {";
    if (s.kind == ShapeKind::plane)
        out += "\"plane\": {\"point\": " + triple(s.a) + ", \"normal\": " + triple(s.b) + "}";
    else if (s.kind == ShapeKind::sphere)
        out +=
            "\"sphere\": {\"center\": " + triple(s.a) + ", \"radius\": " + number(s.radius) + "}";
    else
        out += "\"capsule\": {\"a\": " + triple(s.a) + ", \"b\": " + triple(s.b) +
               ", \"radius\": " + number(s.radius) + "}";
    out += ", \"friction\": " + number(c.friction);
    if (c.contact_distance > 0) out += ", \"contact_distance\": " + number(c.contact_distance);
    if (!motion.empty()) out += ", " + motion;
    return out + "}";
}

std::string scene_text(const ContactScene& scene) {
    const std::string motion = scene.drive ? turn_of_hairball(scene.duration) : "";
    std::string out =
        "// METHODS 2.10, from tools/scenes/contact_scenes.cpp by keratin-contact-scenes.\n"
        "// At its most it has " +
        std::to_string(scene.least_contacts) + " contacts or more.\n{\n";
    out += "  \"solver\": \"rod\",\n  \"step\": " + number(scene.step) +
           ",\n  \"duration\": " + number(scene.duration) +
           ",\n  \"settings\": {\"contact\": \"gauss_seidel\"";
    if (scene.rod.stretch_scale != 1)
        out += ", \"stretch_scale\": " + number(scene.rod.stretch_scale);
    out += "},\n  \"friction\": " + number(scene.contact.friction);
    if (scene.contact.contact_distance > 0)
        out += ",\n  \"contact_distance\": " + number(scene.contact.contact_distance);
    out += ",\n  \"strands\": [\n";
    for (std::size_t s = 0; s < scene.strands.size(); ++s) {
        const RodStrand& strand = scene.strands[s];
        const RodMaterial& m = strand.material;
        out += "    {\"radius\": " + number(m.radii[0]) + ", \"density\": " + number(m.density) +
               ", \"youngs_modulus\": " + number(m.youngs_modulus) +
               ", \"poisson_ratio\": " + number(m.poisson_ratio) + ", \"root\": \"" +
               end_name(strand.root) + "\", \"tip\": \"" + end_name(strand.tip) + "\",\n";
        if (!strand.velocities.empty()) {
            out += "     \"velocities\": [";
            for (std::size_t i = 0; i < strand.velocities.size(); ++i)
                out += (i > 0 ? ", " : "") + triple(strand.velocities[i]);
            out += "],\n";
        }
        if (!motion.empty()) out += "     " + motion + ",\n";
        out += "     \"points\": [";
        for (std::size_t i = 0; i < strand.points.size(); ++i)
            out += (i > 0 ? ", " : "") + triple(strand.points[i]);
        out += s + 1 < scene.strands.size() ? "]},\n" : "]}\n";
    }
    out += "  ]";
    if (!scene.colliders.empty()) {
        out += ",\n  \"colliders\": [\n";
        for (std::size_t c = 0; c < scene.colliders.size(); ++c)
            out += collider_text(scene.colliders[c], motion) +
                   (c + 1 < scene.colliders.size() ? ",\n" : "\n");
        out += "  ]";
    }
    return out + "\n}\n";
}

std::vector<ContactScene> small_scenes() {
    std::vector<ContactScene> all{bundle_on_bundle(19), bundle_on_cylinder(37),
                                  bundle_on_ground(19), two_strands()};
    for (const double friction : {0.0, 0.1, 0.3, 0.6, 1.0})
        for (ContactScene (*make)(double) : {&strand_on_strand, &strand_on_pipe}) {
            all.push_back(make(friction));
            all.back().name += "_" + number(friction).substr(0, 3);
        }
    return all;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2 || argv[1][0] == '-') {
        std::fprintf(
            stderr,
            "usage: keratin-contact-scenes FOLDER [NAME...]\n"
            "Writes the contact scenes of METHODS 2.10 for keratin-run: all but `hairball`, "
            "or those named.\n");
        return argc > 1 && std::strcmp(argv[1], "--help") == 0 ? 0 : 2;
    }
    std::vector<ContactScene> scenes = small_scenes();
    if (argc > 2) {
        scenes.push_back(hairball({}));
        std::vector<ContactScene> wanted;
        for (int i = 2; i < argc; ++i) {
            const auto found =
                std::find_if(scenes.begin(), scenes.end(),
                             [&](const ContactScene& s) { return s.name == argv[i]; });
            if (found == scenes.end()) {
                std::string names;
                for (const ContactScene& s : scenes) names += " " + s.name;
                std::fprintf(stderr,
                             "keratin-contact-scenes: there is no scene `%s`; there are:%s\n",
                             argv[i], names.c_str());
                return 2;
            }
            wanted.push_back(*found);
        }
        scenes = wanted;
    }
    std::error_code ignored;  // a folder that is not there shows when the first file is written
    std::filesystem::create_directories(argv[1], ignored);
    for (const ContactScene& scene : scenes) {
        const std::string file = std::string(argv[1]) + "/" + scene.name + ".json";
        std::ofstream out(file, std::ios::binary);
        out << scene_text(scene);
        if (!out.flush()) {
            std::fprintf(stderr, "keratin-contact-scenes: %s: cannot be written\n", file.c_str());
            return 2;
        }
    }
    return 0;
}
