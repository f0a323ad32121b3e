#include "tools/scenes/contact_run.h"

#include "tools/measure/strand_distance.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>

namespace keratin::scenes {

ContactQuality run_contact_scene(const ContactScene& scene, Contacts contacts,
                                 std::uint64_t measure_every) {
    ContactQuality out;
    Result<RodSimulation> created = RodSimulation::create(scene.strands, scene.rod);
    assert(created);
    RodSimulation& rods = *created;
    StrandContact contact(scene.contact, scene.colliders);
    if (contacts == Contacts::on) rods.attach_contact(&contact);

    std::vector<std::uint32_t> first{0};
    std::vector<double> radius;
    for (const RodStrand& s : scene.strands) {
        first.push_back(first.back() + static_cast<std::uint32_t>(s.points.size()));
        radius.push_back(std::max(s.material.radii[0], s.material.radii[1]));
    }
    std::vector<measure::Point> points(first.back());
    auto energy = [&] {
        double sum = 0;
        for (std::size_t s = 0; s < rods.strand_count(); ++s) {
            const RodEnergy e = rods.energy(s);
            sum += e.kinetic + e.elastic() + e.potential;
        }
        return sum;
    };

    constexpr double kCounted = 0.01;  // of delta: overlaps from here on are counted
    double before = energy(), least = before, most = before, iterations = 0, residuals = 0;
    std::uint64_t converged = 0;
    const std::uint64_t steps =
        static_cast<std::uint64_t>(std::ceil(scene.duration / scene.step - 1e-6));
    for (std::uint64_t k = 1; k <= steps; ++k) {
        const double t = static_cast<double>(k) * scene.step;
        if (scene.drive) scene.drive(rods, t, scene.step);
        const auto start = std::chrono::steady_clock::now();
        const Result<RodStepReport> step = rods.step(scene.step);
        assert(step);
        out.wall_seconds +=
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        ++out.steps;
        iterations += step->contact_iterations;
        out.steps_at_cap += step->at_cap > 0;
        out.steps_halved += step->halved > 0;
        if (contacts == Contacts::on) {
            const ContactReport& report = contact.report();
            out.mean_contacts += static_cast<double>(report.contacts);
            out.most_contacts = std::max(out.most_contacts, report.contacts);
            if (step->at_cap == 0 && report.contacts > 0) {
                ++converged;
                residuals += report.coulomb_residual;
                out.worst_residual = std::max(out.worst_residual, report.coulomb_residual);
            }
        }
        const double now = energy();
        out.energy_rise = std::max(out.energy_rise, now - before);
        before = now;
        least = std::min(least, now);
        most = std::max(most, now);
        if (k % measure_every != 0) continue;
        for (std::size_t s = 0; s < rods.strand_count(); ++s)
            for (std::size_t i = 0; i < rods.vertex_count(s); ++i) {
                const Double3 p = rods.position(s, i);
                points[first[s] + i] = {p[0], p[1], p[2]};
            }
        const measure::Strands strands{first, points};
        const measure::Overlap pair =
            measure::overlap_between(strands, radius, scene.contact.contact_distance, kCounted);
        out.worst_share = std::max(out.worst_share, pair.share);
        out.overlapping_pairs += pair.pairs;
        for (std::size_t c = 0; c < scene.solids.size(); ++c)
            out.worst_solid_share = std::max(
                out.worst_solid_share, measure::overlap_with(strands, radius, scene.solids[c],
                                                             scene.colliders[c].contact_distance,
                                                             kCounted, scene.held_edges)
                                           .share);
    }
    out.energy_scale = most - least;
    out.mean_iterations = iterations / static_cast<double>(std::max<std::uint64_t>(1, out.steps));
    out.mean_contacts /= static_cast<double>(std::max<std::uint64_t>(1, out.steps));
    out.mean_residual = converged > 0 ? residuals / static_cast<double>(converged) : 0;
    out.last_speed = rods.max_speed();
    const std::size_t last = scene.strands.size() - 1;
    const Double3 a = scene.strands[last].points.back(),
                  b = rods.position(last, scene.strands[last].points.size() - 1);
    out.tip_fall = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    return out;
}

}  // namespace keratin::scenes
