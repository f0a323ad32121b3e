#include "schema/read/recipe.h"

#include "groom_generated.h"
#include "kGroomSchema.h"
#include "schema/read/typed_json.h"

#include <algorithm>
#include <set>

namespace keratin {

namespace {

namespace fb = groom_fb;

// The enums of recipe.h and of the schema name the same things in the same order.
template <class To, class From>
To same_word(From from) {
    return static_cast<To>(from);
}
static_assert(int(RootEnd::last) == int(fb::RootEnd::last));
static_assert(int(UpAxis::z) == int(fb::UpAxis::z) && int(UpAxis::x) == int(fb::UpAxis::x));
static_assert(int(Handedness::left) == int(fb::Handedness::left));
static_assert(int(GuideMethod::kmeans) == int(fb::GuideMethod::kmeans) &&
              int(GuideMethod::motion) == int(fb::GuideMethod::motion));
static_assert(int(MeshKeep::bound) == int(fb::MeshKeep::bound) &&
              int(MeshKeep::all) == int(fb::MeshKeep::all));
static_assert(int(ColliderMethod::fit) == int(fb::ColliderMethod::fit));
static_assert(int(Attach::triangle) == int(fb::Attach::triangle));

Ramp to_ramp(const flatbuffers::Vector<double>& values) {
    Ramp out;
    for (const double v : values) out.push_back(static_cast<float>(v));
    return out;
}

// A parameter is one number or a ramp from root to tip, not both.
Result<void> read_ramp(const TypedJson& json, const std::string& path,
                       flatbuffers::Optional<double> number,
                       const flatbuffers::Vector<double>* ramp, Ramp& out) {
    if (number && ramp)
        return json.wrong(path + "_ramp", "`" + path + "` is written too; write only one of them");
    if (number) out = {static_cast<float>(*number)};
    if (ramp) out = to_ramp(*ramp);
    return {};
}

Result<void> read_strand(const TypedJson& json, const std::string& path, const fb::Strand* in,
                         StrandParameters& out, bool& sag_free) {
    if (!in) return {};
    const std::string at = path + ".";
    for (auto ok :
         {read_ramp(json, at + "damping", in->damping(), in->damping_ramp(), out.damping),
          read_ramp(json, at + "friction", in->friction(), in->friction_ramp(), out.friction),
          read_ramp(json, at + "volume", in->volume(), in->volume_ramp(), out.volume),
          read_ramp(json, at + "wind_response", in->wind_response(), in->wind_response_ramp(),
                    out.wind_response)})
        if (!ok) return ok;
    if (in->iterations()) out.iterations = *in->iterations();
    if (in->global_length()) out.global_length = static_cast<float>(*in->global_length());
    if (in->length_damping()) out.length_damping = static_cast<float>(*in->length_damping());
    if (in->sag_free()) sag_free = *in->sag_free();
    return {};
}

void read_rod(const fb::Rod* in, bool& sag_free) {
    if (in && in->sag_free()) sag_free = *in->sag_free();
}

Result<void> read_material(const TypedJson& json, const std::string& path, const fb::Material* in,
                           Material& out) {
    if (!in) return {};
    if (in->radius() && in->radii())
        return json.wrong(path + ".radii", "`radius` is written too; write only one of them");
    if (in->radius()) out.radius = out.radius2 = static_cast<float>(*in->radius());
    if (in->radii()) {
        out.radius = static_cast<float>(in->radii()->a());
        out.radius2 = static_cast<float>(in->radii()->b());
    }
    if (in->density()) out.density = static_cast<float>(*in->density());
    if (in->youngs_modulus()) out.youngs_modulus = static_cast<float>(*in->youngs_modulus());
    if (in->poisson_ratio()) out.poisson_ratio = static_cast<float>(*in->poisson_ratio());
    if (in->viscosity()) out.viscosity = static_cast<float>(*in->viscosity());
    return {};
}

Result<void> read_curves(const TypedJson& json, const fb::Recipe& in, const std::string& folder,
                         Recipe& out) {
    for (flatbuffers::uoffset_t i = 0; i < in.curves()->size(); ++i) {
        const fb::Curves& curves = *in.curves()->Get(i);
        const std::string path = "curves[" + std::to_string(i) + "]";
        CurveSource source;
        source.file = resolve_path(folder, curves.file()->str());
        if (curves.mesh_nodes()) {
            if (!in.mesh())
                return json.wrong(path + ".mesh_nodes",
                                  "names parts of a mesh but the recipe has no `mesh`");
            for (const auto* node : *curves.mesh_nodes()) source.mesh_nodes.push_back(node->str());
        }
        if (curves.group()) source.group = curves.group()->str();
        const auto* bones = curves.bones() ? curves.bones() : in.bones();
        if (bones) source.bones = resolve_path(folder, bones->str());
        if (curves.scale()) source.scale = *curves.scale();
        if (curves.time()) source.time = *curves.time();
        if (curves.root_end()) source.root_end = same_word<RootEnd>(*curves.root_end());
        out.curves.push_back(std::move(source));
    }
    return {};
}

Result<void> read_groups(const TypedJson& json, const fb::Recipe& in, Recipe& out) {
    if (!in.groups()) return {};
    std::set<std::string> names;
    for (flatbuffers::uoffset_t i = 0; i < in.groups()->size(); ++i) {
        const fb::Group& group = *in.groups()->Get(i);
        const std::string path = "groups[" + std::to_string(i) + "]";
        GroupRecipe recipe{group.name()->str(), out.material, out.strand, out.sag_free,
                           out.rod_sag_free};
        if (!names.insert(recipe.name).second)
            return json.wrong(path + ".name", "the group `" + recipe.name + "` is described twice");
        if (auto ok = read_material(json, path + ".material", group.material(), recipe.material);
            !ok)
            return ok;
        if (auto ok = read_strand(json, path + ".strand", group.strand(), recipe.strand,
                                  recipe.sag_free);
            !ok)
            return ok;
        read_rod(group.rod(), recipe.rod_sag_free);
        out.groups.push_back(std::move(recipe));
    }
    return {};
}

// What one field says must not contradict another.
Result<void> check_together(const TypedJson& json, const Recipe& recipe) {
    if (recipe.points_per_strand && recipe.max_error)
        return json.wrong("max_error",
                          "`points_per_strand` is written too; write only one of them");
    if (recipe.attach == Attach::all) {
        const std::string rigid =
            "every point follows its root (\"attach\": \"all\"), so that nothing can sag; leave it "
            "out";
        if (recipe.sag_free) return json.wrong("strand.sag_free", rigid);
        if (recipe.rod_sag_free) return json.wrong("rod.sag_free", rigid);
        for (std::size_t i = 0; i < recipe.groups.size(); ++i) {
            const std::string path = "groups[" + std::to_string(i) + "]";
            if (recipe.groups[i].sag_free) return json.wrong(path + ".strand.sag_free", rigid);
            if (recipe.groups[i].rod_sag_free) return json.wrong(path + ".rod.sag_free", rigid);
        }
    }
    if (!recipe.mesh.empty()) return {};
    if (recipe.attach == Attach::triangle)
        return json.wrong("attach",
                          "roots are to follow triangles but the recipe has no `mesh`; write "
                          "\"mesh\": { \"file\": ... } or \"attach\": \"bone\"");
    if (recipe.colliders == ColliderMethod::fit)
        return json.wrong("colliders", "there is no `mesh` to fit colliders to; write \"none\"");
    if (recipe.push_out)
        return json.wrong("push_out", "there is no `mesh` to push strands out of; write false");
    if (recipe.distance_grid)
        return json.wrong("distance_grid",
                          "there is no `mesh` to measure distances to; leave it out");
    return {};
}

std::vector<std::string> defaulted_fields(const fb::Recipe& in) {
    std::vector<std::string> out;
    const auto note = [&](bool written, const char* path) {
        if (!written) out.push_back(path);
    };
    note(in.scale().has_value(), "scale");
    note(in.up_axis().has_value(), "up_axis");
    note(in.handedness().has_value(), "handedness");
    note(in.points_per_strand().has_value() || in.max_error().has_value(), "points_per_strand");
    note(in.mesh() && in.mesh()->keep().has_value(), "mesh.keep");
    const fb::Guides* guides = in.guides();
    note(guides && guides->fraction().has_value(), "guides.fraction");
    note(guides && guides->method().has_value(), "guides.method");
    note(guides && guides->seed().has_value(), "guides.seed");
    note(guides && guides->measure().has_value(), "guides.measure");
    note(in.attach().has_value(), "attach");
    const fb::Material* material = in.material();
    note(material && (material->radius().has_value() || material->radii()), "material.radius");
    note(material && material->density().has_value(), "material.density");
    note(material && material->youngs_modulus().has_value(), "material.youngs_modulus");
    note(material && material->poisson_ratio().has_value(), "material.poisson_ratio");
    note(material && material->viscosity().has_value(), "material.viscosity");
    const fb::Strand* strand = in.strand();
    note(strand && (strand->damping().has_value() || strand->damping_ramp()), "strand.damping");
    note(strand && (strand->friction().has_value() || strand->friction_ramp()), "strand.friction");
    note(strand && (strand->volume().has_value() || strand->volume_ramp()), "strand.volume");
    note(strand && strand->iterations().has_value(), "strand.iterations");
    note(strand && strand->global_length().has_value(), "strand.global_length");
    note(strand && strand->length_damping().has_value(), "strand.length_damping");
    note(strand && (strand->wind_response().has_value() || strand->wind_response_ramp()),
         "strand.wind_response");
    note(strand && strand->sag_free().has_value(), "strand.sag_free");
    note(in.rod() && in.rod()->sag_free().has_value(), "rod.sag_free");
    note(in.colliders().has_value(), "colliders");
    note(in.push_out().has_value(), "push_out");
    note(in.quantise() != nullptr, "quantise");
    return out;
}

}  // namespace

Result<Recipe> parse_recipe(const std::string& text, const std::string& name,
                            const std::string& folder) {
    TypedJson json;
    if (auto ok = read_typed_json(text, name, kGroomSchema, json); !ok) return ok.error();
    const auto& in = json.table<fb::Recipe>();

    Recipe out;
    out.file = name;
    out.text = text;
    if (auto ok = read_curves(json, in, folder, out); !ok) return ok.error();
    if (in.mesh()) {
        out.mesh = resolve_path(folder, in.mesh()->file()->str());
        if (in.mesh()->keep()) out.mesh_keep = same_word<MeshKeep>(*in.mesh()->keep());
    }
    if (in.scale()) out.scale = *in.scale();
    if (in.up_axis()) out.up_axis = same_word<UpAxis>(*in.up_axis());
    if (in.handedness()) out.handedness = same_word<Handedness>(*in.handedness());
    if (in.points_per_strand()) out.points_per_strand = *in.points_per_strand();
    if (in.max_error()) out.max_error = *in.max_error();
    if (const fb::Guides* guides = in.guides()) {
        if (guides->fraction()) out.guide_fraction = *guides->fraction();
        if (guides->method()) out.guide_method = same_word<GuideMethod>(*guides->method());
        if (guides->seed()) out.guide_seed = *guides->seed();
        if (guides->measure()) out.guide_measure = *guides->measure();
    }
    if (in.attach()) out.attach = same_word<Attach>(*in.attach());
    if (auto ok = read_material(json, "material", in.material(), out.material); !ok)
        return ok.error();
    if (auto ok = read_strand(json, "strand", in.strand(), out.strand, out.sag_free); !ok)
        return ok.error();
    read_rod(in.rod(), out.rod_sag_free);
    if (auto ok = read_groups(json, in, out); !ok) return ok.error();
    if (in.colliders()) out.colliders = same_word<ColliderMethod>(*in.colliders());
    if (in.push_out()) out.push_out = *in.push_out();
    if (const fb::DistanceGrid* grid = in.distance_grid()) {
        out.distance_grid = true;
        if (grid->spacing()) out.distance_grid_spacing = *grid->spacing();
        if (grid->margin()) out.distance_grid_margin = *grid->margin();
    }
    if (const fb::Quantise* quantise = in.quantise()) {
        out.quantise = true;
        if (quantise->max_error()) out.quantise_max_error = *quantise->max_error();
    }
    if (auto ok = check_together(json, out); !ok) return ok.error();
    out.defaulted = defaulted_fields(in);
    return out;
}

Result<Recipe> read_recipe(const std::string& path) {
    auto text = read_text_file(path);
    if (!text) return text.error();
    return parse_recipe(*text, path, folder_of(path));
}

}  // namespace keratin
