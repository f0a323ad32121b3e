// Robustness cases on the rod solver with its contact, with the settings that they ship with.
#include "runtime/contact/strand_contact.h"
#include "runtime/rod/double3.h"
#include "runtime/rod/rod_simulation.h"
#include "tools/keratin-report/stability.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace keratin::report {

namespace {

constexpr double kPi = 3.14159265358979323846;

class RodRun final : public StressRun {
  public:
    static Result<std::unique_ptr<StressRun>> create(const Stress& stress, int threads) {
        auto run = std::make_unique<RodRun>();
        run->stress_ = stress;
        if (auto ok = run->make(threads); !ok) return ok.error();
        return Result<std::unique_ptr<StressRun>>(std::move(run));
    }

    Result<void> step(const StressStep& step) override {
        const std::array<double, 4>& q = step.root.rotation;
        const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (!(std::fabs(norm - 1) < 1e-6))
            return Error{ErrorCode::input, "root.rotation", "is not a unit quaternion"};
        if (!stress_.root_is_free)
            for (std::size_t s = 0; s < stress_.strands.size(); ++s)
                if (auto ok = rods_->move_root(s, {root_place(s, step.root), step.turn}); !ok) return ok;
        drag_beads();
        from_ = to_;
        to_.assign(step.solids.begin(), step.solids.end());
        begin_ = rods_->time();
        length_ = step.h;
        const Result<RodStepReport> done = rods_->step(step.h);
        if (!done) return done.error();
        // a strand that is not finite is lost again in every step
        lost_ = std::max<std::uint64_t>(lost_, done->lost);
        return {};
    }

    std::vector<Double3> points(std::size_t s) const override { return rods_->points(s); }
    std::vector<Double3> velocities(std::size_t s) const override { return rods_->velocities(s); }
    std::vector<double> masses(std::size_t s) const override {
        std::vector<double> out(rods_->vertex_count(s));
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = rods_->vertex_mass(s, i);
        return out;
    }
    // The clamp's frame is an input, no state that could drift.
    double root_error(std::size_t s, const RigidTransform& root) const override {
        return length(subtract(rods_->position(s, 0), root_place(s, root)));
    }
    StressEnergy energy() const override {
        StressEnergy sum;
        for (std::size_t s = 0; s < rods_->strand_count(); ++s) {
            const RodEnergy e = rods_->energy(s);
            sum.kinetic += e.kinetic;
            sum.elastic += e.elastic();
            sum.potential += e.potential;
        }
        return sum;
    }
    std::uint64_t given_up() const override { return lost_; }

    void spoil(std::size_t s, std::size_t vertex) override {
        const_cast<double&>(rods_->numbers()[rods_->layout().index(s, vertex, 1)]) =
            std::numeric_limits<double>::quiet_NaN();
    }
    // Rods, then the contacts that the next step begins with, then the solids' places.
    std::vector<std::byte> save() const override {
        std::vector<std::byte> out;
        const auto put = [&](const void* from, std::size_t size) {
            const auto* p = static_cast<const std::byte*>(from);
            out.insert(out.end(), p, p + size);
        };
        const std::vector<std::byte> rods = rods_->save();
        const std::size_t size = rods.size();
        put(&size, sizeof(size));
        put(rods.data(), size);
        put(to_.data(), to_.size() * sizeof(Double3));
        if (contact_) {
            const std::vector<std::byte> contacts = contact_->save();
            put(contacts.data(), contacts.size());
        }
        return out;
    }
    Result<void> load(std::span<const std::byte> state) override {
        std::size_t size = 0;
        std::memcpy(&size, state.data(), sizeof(size));
        if (auto ok = rods_->restore(state.subspan(sizeof(size), size)); !ok) return ok;
        state = state.subspan(sizeof(size) + size);
        std::memcpy(to_.data(), state.data(), to_.size() * sizeof(Double3));
        state = state.subspan(to_.size() * sizeof(Double3));
        return contact_ ? contact_->restore(state) : Result<void>();
    }

  private:
    Result<void> make(int threads) {
        std::vector<RodStrand> strands;
        const double section = kPi * stress_.radius * stress_.radius;
        for (const StressStrand& s : stress_.strands) {
            RodStrand strand;
            for (const Double3& p : s.points) strand.points.push_back(add(p, stress_.offset));
            for (const Double3& p : s.rest_points) strand.rest_points.push_back(add(p, stress_.offset));
            strand.material.radii = {stress_.radius, stress_.radius};
            strand.material.density = stress_.density;
            strand.material.youngs_modulus = stress_.youngs_modulus;
            strand.material.poisson_ratio = stress_.poisson_ratio;
            // a force of -c v on each unit of mass
            strand.material.air_drag = stress_.mass_damping * stress_.density * section;
            strand.root = stress_.root_is_free ? RodEnd::free : RodEnd::clamped;
            if (!s.density_scale.empty()) {
                for (std::size_t i = 0; i < s.points.size(); ++i) {
                    double own = 0;
                    for (const std::size_t j : {i, i + 1})
                        if (j > 0 && j < s.points.size())
                            own += 0.5 * stress_.density * section * length(subtract(s.rest_points[j], s.rest_points[j - 1]));
                    strand.added_mass.push_back((s.density_scale[i] - 1) * own);
                }
            }
            strands.push_back(std::move(strand));
        }
        for (const RodStrand& s : strands) beads_.push_back(s.added_mass);
        RodSettings settings;
        settings.gravity = {0, -stress_.gravity, 0};
        settings.threads = threads;
        auto made = RodSimulation::create(strands, settings);
        if (!made) return made.error();
        rods_.emplace(std::move(*made));
        if (stress_.solids.empty() && !stress_.strands_touch) return {};
        std::vector<ContactCollider> colliders;
        for (const StressSolid& solid : stress_.solids) {
            to_.push_back(add(solid.at, stress_.offset));
            ContactCollider c;
            c.shape.kind = solid.kind == StressSolid::Kind::sphere ? ShapeKind::sphere : ShapeKind::plane;
            c.shape.b = {solid.normal[0], solid.normal[1], solid.normal[2]};
            c.shape.radius = solid.radius;
            c.friction = stress_.friction;
            c.pose = [this, k = colliders.size()](double time) {
                const double share = length_ > 0 ? (time - begin_) / length_ : 1;
                const Double3 at = from_.empty() ? to_[k] : add(scaled(1 - share, from_[k]), scaled(share, to_[k]));
                RigidPose pose;
                pose.origin = {at[0], at[1], at[2]};
                return pose;
            };
            colliders.push_back(std::move(c));
        }
        ContactSettings contact;
        contact.friction = stress_.friction;
        contact.between_strands = stress_.strands_touch;
        contact.threads = threads;
        contact_ = std::make_unique<StrandContact>(contact, std::move(colliders));
        rods_->attach_contact(contact_.get());
        return {};
    }

    Double3 root_place(std::size_t s, const RigidTransform& root) const {
        const Double3 axis{root.rotation[0], root.rotation[1], root.rotation[2]};
        const double sine = length(axis), angle = 2 * std::atan2(sine, root.rotation[3]);
        const Double3 turn = sine > 0 ? scaled(angle / sine, axis) : Double3{0, 0, 0};
        return add(root.translation, turned(turn, stress_.strands[s].points[0]));
    }

    // The drag of what is added to the strand's own mass.
    void drag_beads() {
        for (std::size_t s = 0; s < beads_.size(); ++s)
            for (std::size_t i = 0; i < beads_[s].size(); ++i)
                (void)rods_->set_force(s, i, scaled(-stress_.mass_damping * beads_[s][i], rods_->velocity(s, i)));
    }

    Stress stress_;
    std::unique_ptr<StrandContact> contact_;
    std::optional<RodSimulation> rods_;
    std::vector<std::vector<double>> beads_;  // kg, added; empty: none
    std::vector<Double3> from_, to_;          // m, of the solids, at the start and end of the step
    double begin_ = 0, length_ = 0;           // s
    std::uint64_t lost_ = 0;
};

}  // namespace

const StressSolver& rod_stress_solver() {
    // criteria_definitions: 1e-9 m in float64.
    static const StressSolver solver{"rod", 1e-9, 1, 1e-9, 1, RodRun::create};
    return solver;
}

}  // namespace keratin::report
