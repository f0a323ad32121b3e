#include "bake/nurbs.h"
#include "bake/read/chains.h"
#include "bake/read/formats.h"
#include "bake/read/obj_text.h"

#include <algorithm>
#include <unordered_map>

namespace keratin {
namespace {

struct Vertex {
    Vec3 position;
    double weight = 1;
    int line = 0;
};

enum class Basis { none, bspline, bezier, other };

// What `cstype` and `deg` say of the curves after them.
struct Form {
    Basis basis = Basis::none;
    bool rational = false;
    long long degree = 0;
};

// What `g` and `o` say.
struct Label {
    std::string name;
    std::uint32_t group = 0;
};

// A curve as written, up to its `end`, or a polyline.
struct Draft {
    bool is_polyline = false;
    Form form;
    std::size_t label = 0;
    int line = 0;
    double u_begin = 0, u_end = 0;
    std::vector<std::uint32_t> vertices;
    std::vector<double> parameters;
    std::string fault;
};

struct Parsing {
    Parsing(std::string_view text_, const std::string& file_) : text(text_), file(file_) {}

    std::string_view text;
    const std::string& file;
    std::vector<Vertex> vertices;
    std::vector<std::string> group_names;
    std::unordered_map<std::string, std::uint32_t> group_of;
    std::vector<Label> labels = std::vector<Label>(1);  // the last one holds
    Form form;
    std::vector<Draft> drafts;
    bool in_curve = false;
    struct EdgeOrigin {
        std::size_t label = 0;
        int line = 0;
    };
    std::vector<Edge> edges;  // of the `l` with two vertices
    std::vector<EdgeOrigin> edge_origin;

    Error wrong(std::string_view word, const std::string& what) const {
        return {ErrorCode::input, place_of(word, text, file), what};
    }
};

std::string quoted(std::string_view word) { return '"' + std::string(word) + '"'; }

Result<void> read_vertex(Parsing& parsing, const ObjStatement& statement) {
    double values[4];
    if (auto read = read_numbers(statement, parsing.text, parsing.file, 3, values); !read)
        return read;
    Vertex vertex{{values[0], values[1], values[2]}, 1, statement.line};
    // Three numbers more are a colour.
    if (statement.words.size() == 5) vertex.weight = values[3];
    parsing.vertices.push_back(vertex);
    return {};
}

void read_label(Parsing& parsing, const ObjStatement& statement) {
    Label label = parsing.labels.back();
    label.name = join_words(statement, 1);
    if (statement.words[0] == "o") {
        auto& names = parsing.group_names;
        // The curves above the first `o` keep a group of their own.
        if (names.empty() && !(parsing.drafts.empty() && parsing.edges.empty())) {
            names.push_back("default");
            parsing.group_of["default"] = 0;
        }
        const auto [found, is_new] =
            parsing.group_of.try_emplace(label.name, static_cast<std::uint32_t>(names.size()));
        if (is_new) names.push_back(label.name);
        label.group = found->second;
    }
    parsing.labels.push_back(std::move(label));
}

Result<void> read_cstype(Parsing& parsing, const ObjStatement& statement) {
    const auto& words = statement.words;
    const bool rational = words.size() > 1 && words[1] == "rat";
    const std::size_t at = rational ? 2 : 1;
    if (words.size() <= at)
        return parsing.wrong(words[0], "\"cstype\" needs the name of a curve type");
    parsing.form.rational = rational;
    parsing.form.basis = words[at] == "bspline"  ? Basis::bspline
                         : words[at] == "bezier" ? Basis::bezier
                                                 : Basis::other;
    return {};
}

Result<void> read_degree(Parsing& parsing, const ObjStatement& statement) {
    const auto degree =
        statement.words.size() > 1 ? parse_integer(statement.words[1]) : std::nullopt;
    if (!degree) return parsing.wrong(statement.words.back(), "\"deg\" needs a whole number");
    parsing.form.degree = *degree;
    return {};
}

// The vertices from words[first] on; of "v/vt" the v. One that is out of range is the draft's
// fault.
Result<void> read_vertex_list(Parsing& parsing, const ObjStatement& statement, std::size_t first,
                              Draft& draft) {
    for (std::size_t i = first; i < statement.words.size(); ++i) {
        const std::string_view whole = statement.words[i];
        const std::string_view word = whole.substr(0, whole.find('/'));
        const auto index = parse_integer(word);
        if (!index) return parsing.wrong(whole, quoted(whole) + " is not the number of a vertex");
        const auto vertex = resolve_index(*index, parsing.vertices.size());
        if (vertex) {
            draft.vertices.push_back(static_cast<std::uint32_t>(*vertex));
        } else if (draft.fault.empty()) {
            draft.fault = "vertex " + std::string(word) + " is out of range; " +
                          std::to_string(parsing.vertices.size()) + " stand above it";
        }
    }
    return {};
}

Result<void> read_curv(Parsing& parsing, const ObjStatement& statement) {
    double range[2];
    if (auto read = read_numbers(statement, parsing.text, parsing.file, 2, range); !read)
        return read;
    Draft draft;
    draft.form = parsing.form;
    draft.label = parsing.labels.size() - 1;
    draft.line = statement.line;
    draft.u_begin = range[0];
    draft.u_end = range[1];
    if (auto read = read_vertex_list(parsing, statement, 3, draft); !read) return read;
    parsing.drafts.push_back(std::move(draft));
    parsing.in_curve = true;
    return {};
}

Result<void> read_parm(Parsing& parsing, const ObjStatement& statement) {
    if (!parsing.in_curve || statement.words.size() < 2 || statement.words[1] != "u") return {};
    for (std::size_t i = 2; i < statement.words.size(); ++i) {
        const auto value = parse_number(statement.words[i]);
        if (!value)
            return parsing.wrong(statement.words[i],
                                 quoted(statement.words[i]) + " is not a number");
        parsing.drafts.back().parameters.push_back(*value);
    }
    return {};
}

Result<void> read_polyline(Parsing& parsing, const ObjStatement& statement) {
    Draft draft;
    draft.is_polyline = true;
    draft.label = parsing.labels.size() - 1;
    draft.line = statement.line;
    if (auto read = read_vertex_list(parsing, statement, 1, draft); !read) return read;
    if (draft.vertices.size() == 2 && draft.fault.empty()) {
        parsing.edges.push_back({draft.vertices[0], draft.vertices[1]});
        parsing.edge_origin.push_back({draft.label, draft.line});
        return {};
    }
    if (draft.vertices.size() < 2 && draft.fault.empty())
        draft.fault = "it has fewer than 2 points";
    parsing.drafts.push_back(std::move(draft));
    return {};
}

Result<void> read_statement(Parsing& parsing, const ObjStatement& statement) {
    const std::string_view name = statement.words[0];
    if (parsing.in_curve) {
        if (name == "parm") return read_parm(parsing, statement);
        if (name == "end") parsing.in_curve = false;
        if (name == "curv" || name == "l" || name == "cstype")
            return parsing.wrong(name, "the curve of line " +
                                           std::to_string(parsing.drafts.back().line) +
                                           " has no \"end\" above this line");
    }
    if (name == "v") return read_vertex(parsing, statement);
    if (name == "o" || name == "g") read_label(parsing, statement);
    if (name == "cstype") return read_cstype(parsing, statement);
    if (name == "deg") return read_degree(parsing, statement);
    if (name == "curv") return read_curv(parsing, statement);
    if (name == "l") return read_polyline(parsing, statement);
    return {};
}

// Turns the chains of the edges into drafts, each on the line of its first edge.
void add_chains(Parsing& parsing) {
    if (parsing.edges.empty()) return;
    for (Chain& chain : build_chains(parsing.edges, parsing.vertices.size())) {
        Draft draft;
        draft.is_polyline = true;
        draft.label = parsing.edge_origin[chain.first_edge].label;
        draft.line = parsing.edge_origin[chain.first_edge].line;
        draft.vertices = std::move(chain.vertices);
        const std::string vertex = std::to_string(chain.vertex + 1);
        switch (chain.fault) {
            case ChainFault::none:
                break;
            case ChainFault::fork:
                draft.fault = "the lines fork at vertex " + vertex + "; a strand has two ends";
                break;
            case ChainFault::loop:
                draft.fault = "the lines close to a loop; a strand has two ends";
                break;
            case ChainFault::one_point:
                draft.fault = "the line joins vertex " + vertex + " with itself";
                break;
        }
        parsing.drafts.push_back(std::move(draft));
    }
    std::stable_sort(parsing.drafts.begin(), parsing.drafts.end(),
                     [](const Draft& a, const Draft& b) { return a.line < b.line; });
}

// Bezier pieces end to end are a B-spline whose inner knots stand `degree` times.
std::optional<std::string> bezier_to_bspline(const Draft& draft, std::vector<double>& knots) {
    const auto p = static_cast<std::size_t>(draft.form.degree);
    const std::size_t pieces = draft.parameters.size() - 1;
    if (draft.vertices.size() != pieces * p + 1)
        return std::to_string(draft.vertices.size()) + " points do not make " +
               std::to_string(pieces) + " Bezier pieces of degree " + std::to_string(p) + "; " +
               std::to_string(pieces * p + 1) + " are needed";
    for (std::size_t i = 0; i <= pieces; ++i)
        knots.insert(knots.end(), i == 0 || i == pieces ? p + 1 : p, draft.parameters[i]);
    return {};
}

// Fills the curve from a free-form draft, or says what is wrong with it.
std::optional<std::string> make_nurbs(const Parsing& parsing, const Draft& draft, RawCurve& curve) {
    const Form& form = draft.form;
    if (form.basis == Basis::none) return "no \"cstype\" stands above it";
    if (form.basis == Basis::other)
        return "this type of curve is not known; bspline and bezier are";
    if (form.degree < 1 || form.degree > kMaxDegree)
        return "the degree " + std::to_string(form.degree) + " is not between 1 and " +
               std::to_string(kMaxDegree);
    if (draft.parameters.size() < 2) return "it has no \"parm u\" with its knots";
    curve.degree = static_cast<int>(form.degree);
    for (std::uint32_t vertex : draft.vertices)
        curve.weights.push_back(form.rational ? parsing.vertices[vertex].weight : 1);
    if (form.basis == Basis::bezier) {
        if (auto fault = bezier_to_bspline(draft, curve.knots)) return fault;
    } else {
        curve.knots = draft.parameters;
    }
    if (auto fault = find_nurbs_fault(curve.points, curve.weights, curve.knots, curve.degree))
        return fault;
    const double u_min = curve.knots[static_cast<std::size_t>(form.degree)];
    const double u_max = curve.knots[curve.points.size()];
    if (!(draft.u_begin < draft.u_end)) return "its range of parameters is empty or reversed";
    curve.u_begin = std::clamp(draft.u_begin, u_min, u_max);
    curve.u_end = std::clamp(draft.u_end, u_min, u_max);
    if (!(curve.u_begin < curve.u_end)) return "its range of parameters lies outside of its knots";
    return {};
}

}  // namespace

Result<RawGroom> read_obj_curves(std::string_view text, const std::string& file) {
    Parsing parsing(text, file);
    ObjStatements statements(text);
    ObjStatement statement;
    while (statements.next(statement))
        if (auto read = read_statement(parsing, statement); !read) return read.error();
    if (parsing.in_curve)
        return Error{ErrorCode::input, file + ':' + std::to_string(parsing.drafts.back().line),
                     "the curve has no \"end\"; the file is cut"};
    add_chains(parsing);

    RawGroom groom;
    groom.file = file;
    groom.group_names = parsing.group_names;
    for (std::size_t i = 0; i < parsing.drafts.size(); ++i) {
        Draft& draft = parsing.drafts[i];
        RawCurve curve;
        curve.index = i;
        curve.line = draft.line;
        curve.name = parsing.labels[draft.label].name;
        for (std::uint32_t vertex : draft.vertices) {
            const Vertex& from = parsing.vertices[vertex];
            curve.points.push_back(from.position);
            if (draft.fault.empty() && !is_usable(from.position))
                draft.fault = "its point in line " + std::to_string(from.line) +
                              " is not finite or is immensely far away";
        }
        if (draft.fault.empty() && !draft.is_polyline)
            draft.fault = make_nurbs(parsing, draft, curve).value_or("");
        if (!draft.fault.empty()) {
            groom.problems.push_back({i, draft.line, draft.fault});
            continue;
        }
        groom.curves.push_back(std::move(curve));
        if (!groom.group_names.empty()) groom.group.push_back(parsing.labels[draft.label].group);
    }
    return groom;
}

}  // namespace keratin
