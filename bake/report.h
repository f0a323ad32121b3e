// What a bake tells its caller: findings with stable codes, and the numbers of the bake report. The
// stages only append findings; who prints them, and how, is decided here and in main.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace keratin {

enum class Severity { note, warning, error };

// Every finding a bake can make. Codes never change their meaning; new ones go to the end.
//   X(identifier, code, name, severity, what it means)
// clang-format off
#define KERATIN_BAKE_RULES(X)                                                                                              \
    X(degenerate_strand,   "KB001", "degenerate-strand",   warning, "Strands with fewer than two distinct points, or shorter than a thousandth of the median length of their file, are left out.") \
    X(root_end,            "KB002", "root-end",            note,    "Which end of the curves is the root.")                    \
    X(root_end_mixed,      "KB003", "root-end-mixed",      warning, "The curves of a file run in both directions; each strand's root was chosen by itself.") \
    X(no_mesh,             "KB004", "no-mesh",             note,    "No mesh is given: roots are bound to bones or to one rigid motion, not to triangles.") \
    X(root_far,            "KB005", "root-far-from-mesh",  warning, "Roots stand far from the mesh they are bound to.")        \
    X(size,                "KB006", "implausible-size",    warning, "The size of the hair or body is implausible for hair; check scale and up_axis.") \
    X(starts_inside,       "KB007", "starts-inside-mesh",  warning, "Points of the groom lie inside the mesh at rest.")        \
    X(pushed_out,          "KB008", "pushed-out",          note,    "Points that lay inside the mesh were moved to its surface.") \
    X(bone_weights,        "KB009", "bone-weights",        note,    "Bone weights did not sum to one and were normalised.")    \
    X(no_bones,            "KB010", "no-bones",            note,    "No bones are given: one rigid motion carries everything.") \
    X(bones_missing,       "KB011", "bones-missing",       warning, "Some strands have no bones; they are carried by the first bone.") \
    X(points_for_strand,   "KB012", "points-for-strand-solver", warning, "The strand solver takes 3 to 32 points a strand; other solvers take these strands.") \
    X(ids_not_unique,      "KB013", "ids-not-unique",      warning, "Authored ids are not unique; strands are numbered through all files instead.") \
    X(few_guides,          "KB014", "few-guides",          note,    "Groups with fewer than three guides repeat one of them with weight zero.") \
    X(authored_guides,     "KB015", "authored-guides",     note,    "Guides or weights authored in the curve file are used.")  \
    X(authored_dropped,    "KB016", "authored-guides-dropped", warning, "Authored guides or weights cannot be used and were replaced by computed ones.") \
    X(collider_gap,        "KB017", "collider-gap",        warning, "Parts of the mesh near the hair stick out of the fitted colliders.") \
    X(group_unused,        "KB018", "group-unused",        warning, "A group of the recipe has no strands.")                   \
    X(error_bound,         "KB019", "max-error-missed",    warning, "Strands need more points than allowed to stay within max_error.") \
    X(file_unit,           "KB020", "file-unit",           note,    "The curve file states its own unit, which was used.")      \
    X(unused_triangles,    "KB021", "degenerate-triangles", note,   "Triangles without area were left out of the search for roots.") \
    X(duplicate_strand,    "KB022", "duplicate-strand",    warning, "Strands with the same points as an earlier strand.")      \
    X(unusable_curve,      "KB023", "unusable-curve",      warning, "Curves of which nothing can be made (too few points, unsound knots or weights, numbers that are not finite) are left out.") \
    X(curve_file,          "KB024", "curve-file",          warning, "Something that a curve file says could not be used as it stands; what was done instead is said.") \
    X(sags,                "KB025", "sags",                warning, "Guides are too soft to be made sag-free: they settle off their groomed pose.") \
    X(rod_sags,            "KB026", "rod-sags",            warning, "Guides are too soft to be made sag-free for the rod solver: as rods they settle off their groomed pose.")
// clang-format on

enum class Rule : std::uint8_t {
#define X(identifier, code, name, severity, meaning) identifier,
    KERATIN_BAKE_RULES(X)
#undef X
};

struct RuleDescription {
    Rule rule;
    std::string_view code, name;
    Severity severity;
    std::string_view meaning;
};

inline constexpr auto kBakeRules = std::to_array<RuleDescription>({
#define X(identifier, code, name, severity, meaning) \
    {Rule::identifier, code, name, Severity::severity, meaning},
    KERATIN_BAKE_RULES(X)
#undef X
});

constexpr const RuleDescription& describe(Rule rule) {
    return kBakeRules[static_cast<std::size_t>(rule)];
}

// Strand numbers first..last of a curve file, both included, counted from 0.
struct StrandRange {
    std::uint32_t first = 0, last = 0;
    bool operator==(const StrandRange&) const = default;
};

struct Finding {
    Rule rule = Rule::degenerate_strand;
    std::string where;                 // file it concerns, as the recipe names it; may be empty
    std::string message;               // what was found and what was done instead
    std::vector<StrandRange> strands;  // ascending
};

// Appended to by the stages.
using Findings = std::vector<Finding>;

// Number of strands in the ranges.
std::uint64_t strand_total(std::span<const StrandRange> ranges);

// Ascending numbers as ranges.
std::vector<StrandRange> to_ranges(std::span<const std::uint32_t> ascending);

// "3, 7-12, 40 and 1204 more": at most `limit` ranges.
std::string to_text(std::span<const StrandRange> ranges, std::size_t limit);

// Mean, 95th percentile and largest of some lengths.
struct Spread {
    double mean = 0, p95 = 0, max = 0;
};
Spread spread_of(std::vector<double> values);

// The numbers of one bake. Lengths in m. Optional members are absent where the stage had nothing to
// do.
struct BakeReport {
    std::string recipe;
    std::string output;
    std::uint64_t output_bytes = 0;
    bool output_changed = true;

    struct Source {
        std::string file;
        std::uint64_t curves = 0, left_out = 0;
        std::string root_end;                 // "first", "last", "mixed"
        std::string root_end_from;            // "recipe", "mesh", "default"
        std::uint64_t reversed = 0;           // strands turned round
        double scale = 1;                     // m per file unit
        std::optional<Spread> root_distance;  // to the mesh parts it grows on
    };
    std::vector<Source> sources;

    struct Group {
        std::string name;
        std::uint64_t strands = 0, guides = 0;
    };
    std::vector<Group> groups;

    std::uint64_t strands = 0, points = 0, guides = 0, tiles = 0, rows = 0;
    std::uint32_t points_min = 0, points_max = 0;
    double padding = 0;  // share of the guide rows that hold no point of a guide

    std::array<double, 3> hair_size{};               // extents along x, y, z
    std::optional<std::array<double, 3>> body_size;  // of the parts on which hair grows
    std::optional<std::array<double, 3>> mesh_size;  // of the whole mesh
    Spread length;                                   // of the strands

    struct Inside {
        std::uint64_t strands = 0, points = 0;  // deeper than `depth`
        double depth = 0.001;
        double deepest = 0;
        std::uint64_t pushed = 0;  // points moved out
    };
    std::optional<Inside> inside;

    struct Colliders {
        std::uint64_t count = 0;
        Spread outside;  // how far the colliders' surface stands outside the mesh
        Spread gap;      // how far the mesh sticks out of the colliders, near the hair
    };
    std::optional<Colliders> colliders;

    struct DistanceGrid {
        double spacing = 0;
        std::uint64_t bricks = 0, stored_bricks = 0;
        Spread error;  // against the exact distance, at the mesh and half-way between nodes
    };
    std::optional<DistanceGrid> distance_grid;

    struct Reconstruction {
        std::string method;  // guides
        Spread error;        // m, of interpolated strands in motion
    };
    std::optional<Reconstruction> reconstruction;

    // Rest shapes made to bear the weight in the groomed pose.
    struct SagFree {
        std::uint64_t guides = 0, too_soft = 0;
        Spread residual;  // unbalanced force across a segment (rods: on a point) over the weight
        Spread settles;   // m, from the groomed pose to where a guide comes to rest
        struct Guide {
            std::uint32_t strand = 0;
            bool held = false;
            double residual = 0, settles = 0;
        };
        std::vector<Guide> each;  // by strand number
    };
    std::optional<SagFree> sag_free, rod_sag_free;

    // Rest positions stored in 16 bits a coordinate.
    struct Quantised {
        std::uint64_t bytes = 0, bytes_before = 0;  // packed, and as floats
        Spread error;                               // m
    };
    std::optional<Quantised> quantised;

    struct Width {
        std::uint64_t strands = 0;
        double scale = 1;
    };
    std::vector<Width> levels;  // of detail: prefixes of the strands and how wide they are drawn

    std::vector<std::string> defaulted;  // recipe fields left to their default

    struct StageTime {
        std::string stage;
        double cpu_seconds = 0;  // of all threads
    };
    std::vector<StageTime> times;

    // What the bake cost until the asset's bytes were there.
    struct Cost {
        int threads = 1;
        double cpu_seconds = 0;          // of all threads
        double busiest_cpu_seconds = 0;  // of the thread that worked most
        std::uint64_t peak_bytes = 0;    // most memory resident at once; 0: unknown
    };
    Cost cost;
};

// One line a fact for people.
std::string report_text(const BakeReport& report, std::span<const Finding> findings);
// One line a finding: "file: strands 3, 7-12: warning KB001 degenerate-strand: message".
std::string finding_text(const Finding& finding);
// The document `keratin-bake --json` prints (schema/report/keratin-bake.schema.json).
std::string report_json(const BakeReport& report, std::span<const Finding> findings);
// The findings as SARIF 2.1.0.
std::string report_sarif(const BakeReport& report, std::span<const Finding> findings,
                         std::string_view tool_version);

}  // namespace keratin
