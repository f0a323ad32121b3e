#include "tools/keratin-diff/compare_runs.h"

#include "schema/file_hash.h"
#include "tools/keratin-diff/number_text.h"
#include "tools/keratin-diff/report_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace keratin::diff {

namespace {

enum Row { frames, strands, guide_position, strand_position, body_position, time, assets };

// Gathers differences of one kind over all frames. The p99 comes from a histogram with 64 bins to a
// factor of two, so that memory does not grow with the run.
class Tally {
  public:
    explicit Tally(RunDifference& out) : out_(out), bins_(kBins) {}

    // Whether this is the largest so far.
    bool add(double amount) {
        ++out_.compared;
        if (!(amount > 0)) return false;
        ++out_.differing;
        square_ += amount * amount;
        const double place = (std::log2(amount) - kLowest) * kPerOctave;
        ++bins_[static_cast<std::size_t>(std::clamp(place, 0.0, kBins - 1.0))];
        if (amount <= out_.spread.max) return false;
        out_.spread.max = amount;
        return true;
    }

    void finish() {
        if (out_.differing == 0) return;
        out_.spread.rms = std::sqrt(square_ / static_cast<double>(out_.compared));
        std::size_t above = out_.compared / 100;
        for (std::size_t b = kBins; b-- > 0;) {
            if (bins_[b] > above) {
                const double middle =
                    std::exp2((static_cast<double>(b) + 0.5) / kPerOctave + kLowest);
                out_.spread.p99 = std::min(out_.spread.max, middle);
                return;
            }
            above -= bins_[b];
        }
    }

  private:
    static constexpr int kLowest = -60, kHighest = 20, kPerOctave = 64;
    static constexpr std::size_t kBins = (kHighest - kLowest) * kPerOctave;

    RunDifference& out_;
    std::vector<std::size_t> bins_;
    double square_ = 0;
};

std::string point_text(const std::array<double, 3>& p) { return values_text(p); }

std::string change_text(const std::string& where, const std::string& a, const std::string& b) {
    return where + ": " + a + " -> " + b;
}

void compare_points(const char* what, std::span<const std::uint32_t> first_point, std::size_t frame,
                    const std::vector<float>& a, const std::vector<float>& b, Tally& tally,
                    RunDifference& out) {
    for (std::size_t s = 0; s + 1 < first_point.size(); ++s)
        for (std::size_t p = first_point[s]; p < first_point[s + 1]; ++p) {
            const std::array<double, 3> x{a[3 * p], a[3 * p + 1], a[3 * p + 2]},
                y{b[3 * p], b[3 * p + 1], b[3 * p + 2]};
            if (tally.add(std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2])))
                out.worst = change_text("frame " + std::to_string(frame) + " " + what + " " +
                                            std::to_string(s) + " point " +
                                            std::to_string(p - first_point[s]),
                                        point_text(x), point_text(y));
        }
}

void compare_heads(const CacheHead& a, const CacheHead& b, bool same_strands,
                   std::vector<RunDifference>& out) {
    out[strands].compared = std::min(a.strand_radius.size(), b.strand_radius.size());
    if (!same_strands) {
        out[strands].differing = 1;
        out[strands].note =
            std::to_string(a.guide_lane.size()) + " -> " + std::to_string(b.guide_lane.size()) +
            " simulated, " + std::to_string(a.strand_radius.size()) + " -> " +
            std::to_string(b.strand_radius.size()) + " render strands; positions are not compared";
    }
    for (std::size_t i = 0; i < std::max(a.assets.size(), b.assets.size()); ++i) {
        const auto text = [i](const CacheHead& head) {
            return i < head.assets.size() ? value_text(head.assets[i].hash) : std::string("none");
        };
        ++out[assets].compared;
        if (i < std::min(a.assets.size(), b.assets.size()) && a.assets[i].hash == b.assets[i].hash)
            continue;
        ++out[assets].differing;
        if (out[assets].worst.empty())
            out[assets].worst = change_text("asset " + std::to_string(i), text(a), text(b));
    }
}

}  // namespace

std::vector<Subject> run_subjects() {
    return {{"frames", Section::data, ""},          {"strands", Section::data, ""},
            {"guide_position", Section::data, "m"}, {"strand_position", Section::data, "m"},
            {"body_position", Section::data, "m"},  {"time", Section::data, "s"},
            {"assets", Section::origin, ""}};
}

Result<std::vector<RunDifference>> compare_runs(const CacheReader& a, const CacheReader& b) {
    std::vector<RunDifference> out;
    for (const Subject& subject : run_subjects()) {
        out.emplace_back();
        out.back().name = subject.name;
        out.back().unit = subject.unit;
    }
    const CacheHead &x = a.head(), &y = b.head();
    const bool same =
        x.guide_first_point == y.guide_first_point && x.strand_first_point == y.strand_first_point;
    compare_heads(x, y, same, out);
    const std::size_t common = std::min(a.frame_count(), b.frame_count());
    out[frames].compared = common;
    out[frames].differing = std::max(a.frame_count(), b.frame_count()) - common;
    if (out[frames].differing > 0)
        out[frames].note =
            std::to_string(a.frame_count()) + " -> " + std::to_string(b.frame_count()) + " frames";

    Tally guides(out[guide_position]), points(out[strand_position]), bodies(out[body_position]),
        times(out[time]);
    for (std::size_t f = 0; f < common; ++f) {
        auto p = a.frame(f), q = b.frame(f);
        if (!p) return p.error();
        if (!q) return q.error();
        const std::string at = "frame " + std::to_string(f);
        if (times.add(std::abs(p->time - q->time)))
            out[time].worst = change_text(at, number_text(p->time, 9), number_text(q->time, 9));
        for (std::size_t i = 0; i < std::min(p->bodies.size(), q->bodies.size()); ++i) {
            const auto &m = p->bodies[i].motion.translation, &n = q->bodies[i].motion.translation;
            if (bodies.add(std::hypot(m[0] - n[0], m[1] - n[1], m[2] - n[2])))
                out[body_position].worst =
                    change_text(at + " asset " + std::to_string(i), point_text(m), point_text(n));
        }
        if (!same) continue;
        compare_points("simulated strand", x.guide_first_point, f, p->guide_position,
                       q->guide_position, guides, out[guide_position]);
        compare_points("render strand", x.strand_first_point, f, p->strand_position,
                       q->strand_position, points, out[strand_position]);
    }
    for (Tally* tally : {&guides, &points, &bodies, &times}) tally->finish();
    return out;
}

std::vector<Finding> judge(const std::vector<RunDifference>& differences,
                           const Tolerances& tolerances) {
    std::vector<Finding> out;
    for (std::size_t i = 0; i < differences.size(); ++i)
        out.push_back(tolerances.judge(i, differences[i].value()));
    return out;
}

std::string describe(const std::vector<RunDifference>& differences, const std::string& name) {
    for (const RunDifference& d : differences) {
        if (d.name != name || d.differing == 0) continue;
        if (!d.note.empty()) return d.note;
        const auto amount = [&](double x) {
            return d.unit == "m" ? length_text(x) : number_text(x) + " " + std::string(d.unit);
        };
        std::string text =
            std::to_string(d.differing) + " of " + std::to_string(d.compared) + " differ";
        if (!d.unit.empty())
            text += "; max " + amount(d.spread.max) + ", p99 " + amount(d.spread.p99) + ", RMS " +
                    amount(d.spread.rms);
        return text + "; worst: " + d.worst;
    }
    return "";
}

std::string runs_json(const std::vector<RunDifference>& differences,
                      const std::vector<Finding>& findings, const std::string& a,
                      const std::string& b, bool passed, const std::string& version) {
    nlohmann::ordered_json json{
        {"program", "keratin-diff"}, {"version", version}, {"a", a}, {"b", b}, {"passed", passed}};
    json["findings"] = findings_json(
        findings, [&](const std::string& name) { return describe(differences, name); });
    json["compared"] = nlohmann::ordered_json::array();
    for (const RunDifference& d : differences) {
        nlohmann::ordered_json entry{{"name", d.name},
                                     {"unit", d.unit},
                                     {"compared", d.compared},
                                     {"differing", d.differing}};
        if (!d.unit.empty()) {
            entry["max"] = d.spread.max;
            entry["p99"] = d.spread.p99;
            entry["rms"] = d.spread.rms;
        }
        json["compared"].push_back(std::move(entry));
    }
    return dumped(json);
}

}  // namespace keratin::diff
