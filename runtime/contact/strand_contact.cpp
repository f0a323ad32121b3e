#include "runtime/contact/strand_contact.h"

#include "runtime/contact/contact_list.h"
#include "runtime/contact/coulomb.h"
#include "runtime/contact/meeting.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <omp.h>
#include <utility>

namespace keratin {
namespace {

constexpr double kStillComing = 5e-3;      // of the contacts
constexpr std::uint32_t kMostRounds = 20;  // over all strands, of contacts solved together

// What a saved state begins with, and a contact in it.
struct SavedHead {
    std::uint64_t magic = 0x31746361'746e6f63;  // "contact1" in little-endian bytes
    std::uint64_t count = 0;
    double step = 0;  // s, that the impulses are of; 0: there was none
};
struct SavedContact {
    std::uint64_t pair = 0, feature = 0;
    double impulse[3] = {0, 0, 0};  // N s
};

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

}  // namespace

struct StrandContact::Memory {
    ContactSettings settings;
    std::vector<ContactCollider> colliders;
    int threads = 1;
    // Waking a second thread costs more than so few edges or contacts.
    static constexpr std::size_t kEdgesAThread = 2000, kContactsAThread = 200;
    int detection_threads() const { return worth(first_vertex.size(), kEdgesAThread); }
    int solve_threads() const { return worth(contacts.size(), kContactsAThread); }
    int worth(std::size_t count, std::size_t a_thread) const {
        return std::clamp(static_cast<int>(count / a_thread), 1, threads);
    }

    // The strands as edges; rebuilt when the layout changes.
    std::vector<std::uint32_t> layout_first;
    std::vector<Vector3> x_t0, x_t1;
    std::vector<std::uint32_t> vertex_number;  // where a vertex's numbers stand
    std::vector<std::uint32_t> first_vertex, strand, vertex_in_strand;  // of edges
    std::vector<double> radius;
    std::vector<std::uint8_t> prescribed;

    std::vector<MovingShape> shapes;
    Detection detection;
    bool searched = false;  // in this step
    std::vector<Contact> contacts;
    struct Known {
        ContactKey key;
        Vector3 impulse;
    };
    std::vector<Known> before;  // the contacts of the step before that had an impulse
    double before_step = 0;  // s, that `contacts` have impulses of

    std::vector<ContactLaw> laws;
    std::vector<ContactFrame> frames;
    std::vector<SidePlace> places;
    std::vector<double> impulses, applied;  // [3 * contacts], contact frames
    std::vector<double> eased;              // [contacts] m/s
    bool changed = true;                    // contacts since W was assembled
    bool together = false;                  // sweeps have not been enough in this step
    bool unapplied = false;  // remembered impulses that the velocity does not contain yet
    ImpulsePass impulse_pass;
    GaussSeidel gauss_seidel;
    ContactReport report;
    ContactTotals totals;
    std::vector<double> residuals;  // of the step's passes

    ContactStrands view() const { return {x_t0, x_t1, first_vertex, strand, radius, prescribed}; }

    void lay_out(const ContactProblem& problem) {
        const RodLayout& layout = problem.layout;
        layout_first.assign(layout.first.begin(), layout.first.end());
        vertex_number.clear();
        first_vertex.clear();
        strand.clear();
        vertex_in_strand.clear();
        radius.clear();
        for (std::size_t s = 0; s < layout.first.size(); ++s)
            for (std::uint32_t i = 0; i < layout.vertex_count[s]; ++i) {
                if (i + 1 < layout.vertex_count[s]) {
                    first_vertex.push_back(static_cast<std::uint32_t>(vertex_number.size()));
                    strand.push_back(static_cast<std::uint32_t>(s));
                    vertex_in_strand.push_back(i);
                    radius.push_back(problem.radius[s]);
                }
                vertex_number.push_back(static_cast<std::uint32_t>(layout.index(s, i, 0)));
            }
        x_t0.resize(vertex_number.size());
        x_t1.resize(vertex_number.size());
        prescribed.resize(vertex_number.size());
    }

    // Laws, rows and frame coordinates of the impulses, from the contacts.
    void write_laws(const ContactProblem& problem) {
        const std::size_t n = contacts.size();
        laws.resize(n);
        frames.resize(n);
        places.resize(2 * n);
        impulses.resize(3 * n);
        applied.resize(3 * n);
        const ContactStrands strands = view();
#pragma omp parallel for num_threads(solve_threads()) schedule(static)
        for (std::size_t c = 0; c < n; ++c) {
            const Contact& contact = contacts[c];
            const ContactFrame frame = contact_frame(contact.normal);
            ContactLaw& law = laws[c];
            frames[c] = frame;
            law.sides = contact.against_collider ? 1 : 2;
            law.friction = contact.friction;
            for (int k = 0; k < 3; ++k) {
                law.constant[k] = -dot(frame.axis[k], contact.obstacle_velocity);
                impulses[3 * c + k] = dot(frame.axis[k], contact.impulse);
                applied[3 * c + k] = dot(frame.axis[k], contact.applied);
            }
            law.constant[0] += contact.gap / problem.step;
            for (std::uint32_t side = 0; side < law.sides; ++side) {
                const std::uint32_t edge = contact.edge[side];
                law.rows[side] = make_rows(strands, contact, static_cast<int>(side), frame,
                                           vertex_number[first_vertex[edge]], problem.layout.lanes);
                places[2 * c + side] = {strand[edge], vertex_in_strand[edge]};
            }
        }
        changed = true;
    }

    // The law is linear in v, the distance at the end of the step is not: what was taken anew gets
    // the gap for which the law foretells the end of the step that v leads to.
    void correct_gaps(const ContactProblem& problem, std::span<const double> v) {
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            Contact& contact = contacts[c];
            if (!(contact.shortfall > 0)) continue;
            double u[3];
            relative_velocity(laws[c], v, u);
            const double change = -contact.shortfall - problem.step * u[0];
            contact.gap += change;
            laws[c].constant[0] += change / problem.step;
        }
    }

    // Mean |f_FB| over the list (METHODS 2.10).
    double mean_residual(const ContactProblem& problem, std::span<const double> v) const {
        double sum = 0;
        const double us = 1 / problem.gravity_speed, rs = us / problem.mean_vertex_mass;
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            double u[3];
            relative_velocity(laws[c], v, u);
            const double* r = &impulses[3 * c];
            sum += coulomb_residual(Local3<Double1>{r[0] * rs, r[1] * rs, r[2] * rs},
                                    Local3<Double1>{u[0] * us, u[1] * us, u[2] * us},
                                    Double1(std::min(laws[c].friction, kMostFriction)))
                       .v;
        }
        return contacts.empty() ? 0 : sum / static_cast<double>(contacts.size());
    }

    // Gives new contacts the impulses of the step before: what each had, once, as far as its normal
    // of now allows it.
    void start_from_before() {
        auto give = [&](Known& r, Contact& c) {
            const Vector3 had = std::exchange(r.impulse, Vector3(0));
            const double n = dot(had, c.normal);
            if (n <= 0) return;
            Vector3 t = had - n * c.normal;
            const double most = std::min(c.friction, kMostFriction) * n, size = length(t);
            if (size > most) t *= most / size;
            c.impulse = n * c.normal + t;
            unapplied = true;
        };
        std::size_t i = 0;
        for (Contact& c : contacts) {
            while (i < before.size() && before[i].key < c.key) ++i;
            if (i == before.size()) break;
            if (before[i].key == c.key) give(before[i], c);
        }
        // What has slid on a round solid may have the name of a part or two on by now.
        i = 0;
        for (Contact& c : contacts) {
            while (i < before.size() && before[i].key.pair < c.key.pair) ++i;
            if (i == before.size()) break;
            if (!c.fresh || !c.by_place || squared_length(c.impulse) > 0) continue;
            Known* nearest = nullptr;
            int distance = 3;  // parts
            for (std::size_t k = i; k < before.size() && before[k].key.pair == c.key.pair; ++k) {
                const int d = std::abs(name_on_solid(before[k].key) - name_on_solid(c.key));
                if (name_on_solid(before[k].key) == 0 || d >= distance ||
                    squared_length(before[k].impulse) == 0)
                    continue;
                nearest = &before[k];
                distance = d;
            }
            if (nearest) give(*nearest, c);
        }
    }

    void write_back() {
        for (std::size_t c = 0; c < contacts.size() && 3 * c < impulses.size(); ++c) {
            contacts[c].impulse = contacts[c].applied = Vector3(0);
            for (int k = 0; k < 3; ++k) {
                contacts[c].impulse += impulses[3 * c + k] * frames[c].axis[k];
                contacts[c].applied += applied[3 * c + k] * frames[c].axis[k];
            }
        }
    }
};

StrandContact::StrandContact(ContactSettings settings, std::vector<ContactCollider> colliders)
    : memory_(std::make_unique<Memory>()) {
    memory_->settings = settings;
    memory_->colliders = std::move(colliders);
    memory_->threads = settings.threads > 0 ? settings.threads : omp_get_max_threads();
}
StrandContact::~StrandContact() = default;

void StrandContact::set_friction(double strands, double colliders) {
    memory_->settings.friction = strands;
    for (ContactCollider& c : memory_->colliders) c.friction = colliders;
}

std::span<const Contact> StrandContact::contacts() const { return memory_->contacts; }
std::span<const double> StrandContact::residuals() const { return memory_->residuals; }
const ContactReport& StrandContact::report() const { return memory_->report; }
const ContactTotals& StrandContact::totals() const { return memory_->totals; }
void StrandContact::reset_totals() { memory_->totals = {}; }

std::vector<std::byte> StrandContact::save() const {
    const std::vector<Contact>& contacts = memory_->contacts;
    std::vector<std::byte> out(sizeof(SavedHead) + contacts.size() * sizeof(SavedContact));
    const SavedHead head{.count = contacts.size(), .step = memory_->before_step};
    std::memcpy(out.data(), &head, sizeof head);
    std::byte* at = out.data() + sizeof head;
    for (const Contact& c : contacts) {
        const SavedContact saved{
            c.key.pair, c.key.feature, {c.impulse.x, c.impulse.y, c.impulse.z}};
        std::memcpy(at, &saved, sizeof saved);
        at += sizeof saved;
    }
    return out;
}

Result<void> StrandContact::restore(std::span<const std::byte> state) {
    const auto bad = [](const char* what) { return Error{ErrorCode::input, "state", what}; };
    SavedHead head;
    if (state.size() < sizeof head) return bad("is not one of contacts");
    std::memcpy(&head, state.data(), sizeof head);
    state = state.subspan(sizeof head);
    if (head.magic != SavedHead{}.magic || state.size() % sizeof(SavedContact) != 0 ||
        state.size() / sizeof(SavedContact) != head.count)
        return bad("is not one of contacts");
    if (!(head.step >= 0) || !std::isfinite(head.step)) return bad("holds a step that no run has");
    std::vector<Contact> contacts(head.count);
    for (Contact& c : contacts) {
        SavedContact saved;
        std::memcpy(&saved, state.data(), sizeof saved);
        state = state.subspan(sizeof saved);
        const double* r = saved.impulse;
        if (!std::all_of(r, r + 3, [](double v) { return std::isfinite(v); }))
            return bad("holds an impulse that is not finite");
        c.key = {saved.pair, static_cast<std::uint32_t>(saved.feature)};
        c.impulse = {r[0], r[1], r[2]};
    }
    memory_->contacts = std::move(contacts);
    memory_->before_step = head.step;
    memory_->impulses.clear();
    return {};
}

void StrandContact::attached() { memory_->gauss_seidel = GaussSeidel(); }

void StrandContact::begin_step(const ContactProblem& problem) {
    Memory& m = *memory_;
    const double start = now();
    if (!std::equal(m.layout_first.begin(), m.layout_first.end(), problem.layout.first.begin(),
                    problem.layout.first.end())) {
        m.lay_out(problem);
        m.gauss_seidel = GaussSeidel();
    }
    const std::uint32_t lanes = problem.layout.lanes;
#pragma omp parallel for num_threads(m.detection_threads()) schedule(static)
    for (std::size_t i = 0; i < m.vertex_number.size(); ++i) {
        const std::size_t at = m.vertex_number[i];
        m.x_t0[i] = {problem.x_t0[at], problem.x_t0[at + lanes], problem.x_t0[at + 2 * lanes]};
        m.prescribed[i] = problem.inverse_mass[at] == 0;
    }
    const Vector3 origin{problem.origin[0], problem.origin[1], problem.origin[2]};
    m.shapes.clear();
    for (const ContactCollider& c : m.colliders) {
        MovingShape shape{c.shape, {}, {}, c.friction, c.contact_distance};
        if (c.pose) {
            shape.pose_t0 = c.pose(problem.time);
            shape.pose_t1 = c.pose(problem.time + problem.step);
        }
        shape.pose_t0.origin -= origin;
        shape.pose_t1.origin -= origin;
        m.shapes.push_back(shape);
    }
    m.before.clear();
    if (m.settings.warm_start)
        for (const Contact& c : m.contacts)
            if (squared_length(c.impulse) > 0) m.before.push_back({c.key, c.impulse});
    m.contacts.clear();
    m.impulses.clear();
    m.applied.clear();
    m.laws.clear();
    m.changed = true;
    m.searched = false;
    m.together = false;
    m.unapplied = false;
    m.report = {};
    m.residuals.clear();
    if (m.before_step > 0)
        for (Memory::Known& r : m.before) r.impulse *= problem.step / m.before_step;
    m.before_step = problem.step;
    m.totals.bookkeeping_seconds += now() - start;
}

std::size_t StrandContact::detect(const ContactProblem& problem, std::span<const double> v) {
    Memory& m = *memory_;
    double start = now();
    const std::uint32_t lanes = problem.layout.lanes;
#pragma omp parallel for num_threads(m.detection_threads()) schedule(static)
    for (std::size_t i = 0; i < m.vertex_number.size(); ++i) {
        const std::size_t at = m.vertex_number[i];
        m.x_t1[i] = m.x_t0[i] + Vector3(v[at], v[at + lanes], v[at + 2 * lanes]) * problem.step;
    }
    DetectionSettings settings;
    settings.step = problem.step;
    settings.friction = m.settings.friction;
    settings.contact_distance = m.settings.contact_distance;
    settings.between_strands = m.settings.between_strands;
    settings.threads = m.detection_threads();
    settings.instruction_set = m.settings.instruction_set;
    const ContactStrands strands = m.view();
    m.write_back();
    const std::span<const FoundContact> found =
        m.detection.find(strands, m.shapes, settings, m.searched);
    m.searched = true;
    ++m.report.detections;
    m.totals.detection_seconds += now() - start;

    start = now();
    const std::size_t refreshed = refresh_contacts(strands, m.shapes, settings, m.contacts);
    std::size_t added = merge_contacts(found, m.contacts);
    if (added > 0) m.start_from_before();
    const United united = added + refreshed > 0 ? unite_contacts(strands, m.contacts) : United();
    added -= united.fresh;
    // While contacts still come in number, where the others are now says little.
    if (static_cast<double>(added) > kStillComing * static_cast<double>(m.contacts.size()))
        for (Contact& c : m.contacts) c.renewals = 0;
    if (added + refreshed + united.all > 0) m.write_laws(problem);
    if (refreshed > 0) m.correct_gaps(problem, v);
    m.totals.bookkeeping_seconds += now() - start;
    if (added + refreshed == 0) {
        start = now();
        m.report.overlapping = m.detection.overlapping(strands, settings) +
                               overlapping_round_solids(strands, m.shapes, settings, m.contacts);
        m.totals.detection_seconds += now() - start;
    }
    return added + refreshed;
}

bool StrandContact::overlaps() const { return memory_->report.overlapping > 0; }

ContactPass StrandContact::pass(const ContactProblem& problem, std::span<const double> v,
                                const RodInverse& inverse, std::span<double> impulse) {
    Memory& m = *memory_;
    double start = now();
    const std::size_t n = m.contacts.size();
    double change = 0, residual = 0;
    bool stalled = false, unfinished = false;
    ++m.report.passes;
    if (n > 0 && m.settings.method == ContactMethod::impulse) {
        residual = m.mean_residual(problem, v);
        if (m.unapplied) {
            // The local answer needs a velocity that contains what is there already.
            for (std::size_t i = 0; i < m.impulses.size(); ++i)
                change += std::fabs(m.impulses[i] - m.applied[i]);
        } else {
            change = m.impulse_pass.run(m.laws, v, problem.inverse_mass, m.settings.local_inertia,
                                        m.solve_threads(), m.impulses);
        }
    } else if (n > 0) {
        if (m.changed)
            m.gauss_seidel.assemble(problem.layout, m.laws, m.places, inverse, m.solve_threads(),
                                    m.together, m.impulses);
        else
            m.gauss_seidel.renew(problem.layout, m.laws, m.places, inverse, m.solve_threads(),
                                 m.together);
        m.changed = false;
        GaussSeidelSettings settings;
        settings.threads = m.solve_threads();
        settings.most_sweeps = m.settings.most_sweeps;
        settings.residual = m.settings.sweep_residual;
        settings.gain = m.settings.sweep_gain;
        settings.accepted = m.settings.accepted_residual;
        settings.velocity_scale = problem.gravity_speed;
        settings.impulse_scale = problem.gravity_speed * problem.mean_vertex_mass;
        settings.instruction_set = m.settings.instruction_set;
        m.eased.resize(n);
        double least_distance = std::numeric_limits<double>::infinity();
#pragma omp parallel for num_threads(m.solve_threads()) schedule(static) \
    reduction(min                                                        \
              : least_distance)
        for (std::size_t c = 0; c < n; ++c) {
            m.eased[c] = m.contacts[c].eased / problem.step;
            least_distance = std::min(least_distance, m.contacts[c].distance);
        }
        settings.leeway = m.settings.gap_leeway * least_distance / problem.step;
        GaussSeidelReport report =
            m.gauss_seidel.solve(m.laws, v, m.applied, settings, m.impulses, m.eased);
#pragma omp parallel for num_threads(m.solve_threads()) schedule(static)
        for (std::size_t c = 0; c < n; ++c) {
            const double moved = m.eased[c] - m.contacts[c].eased / problem.step;
            m.laws[c].constant[0] += moved;
            m.contacts[c].gap += moved * problem.step;
            m.contacts[c].eased = m.eased[c] * problem.step;
        }
        const double enough =
            std::max(m.settings.accepted_residual, m.settings.sweep_gain * report.start);
        if (m.together && report.residual > enough) {
            settings.most_sweeps = kMostRounds;
            const GaussSeidelReport more =
                m.gauss_seidel.solve_strands(m.laws, m.places, v, m.applied, settings, m.impulses);
            report.residual = more.residual;
            report.change += more.change;
        }
        m.together = m.together || report.residual > enough;
        m.report.sweeps += report.sweeps;
        change = report.change;
        residual = report.start;
        stalled = report.residual > enough;
        unfinished = !stalled && report.residual > m.settings.accepted_residual;
        if (m.unapplied) change = std::max(change, 1e-300);
    }
    m.residuals.push_back(residual);
    m.unapplied = false;
    m.applied = m.impulses;
    m.totals.solve_seconds += now() - start;

    start = now();
    const std::size_t strands = problem.layout.first.size();
#pragma omp parallel num_threads(m.solve_threads())
    {
#pragma omp for schedule(static)
        for (std::size_t i = 0; i < impulse.size(); ++i) impulse[i] = 0;
        // Each thread adds for strands of its own, so that every sum has its order.
        const auto thread = static_cast<std::size_t>(omp_get_thread_num()),
                   team = static_cast<std::size_t>(omp_get_num_threads());
        const std::size_t first = strands * thread / team, last = strands * (thread + 1) / team;
        for (std::size_t c = 0; c < n; ++c)
            for (std::uint32_t side = 0; side < m.laws[c].sides; ++side)
                if (const std::size_t s = m.places[2 * c + side].strand; first <= s && s < last)
                    add_impulse(m.laws[c].rows[side], &m.impulses[3 * c], impulse);
    }
    m.totals.bookkeeping_seconds += now() - start;
    return {n > 0 ? change / static_cast<double>(n) : 0, n, stalled, unfinished};
}

void StrandContact::end_step(const ContactProblem& problem, std::span<const double> v) {
    Memory& m = *memory_;
    const std::size_t n = m.contacts.size();
    m.write_back();
    m.report.contacts = n;
    for (std::size_t c = 0; c < n; ++c) m.report.active += m.impulses[3 * c] > 0;
    m.report.coulomb_residual = m.mean_residual(problem, v);
    ++m.totals.steps;
    m.totals.contacts += n;
    m.totals.sweeps += m.report.sweeps;
    m.totals.most_contacts = std::max(m.totals.most_contacts, n);
    m.totals.residual_sum += m.report.coulomb_residual;
    m.totals.residual_most = std::max(m.totals.residual_most, m.report.coulomb_residual);
}

}  // namespace keratin
