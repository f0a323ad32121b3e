#include "tools/keratin-diff/compare.h"

#include "tools/keratin-diff/compare_fields.h"
#include "tools/keratin-diff/compare_info.h"
#include "tools/keratin-diff/counterparts.h"

#include <algorithm>
#include <cmath>

namespace keratin::diff {

Report compare(const AssetView& a, const AssetView& b) {
    const Counterparts counterparts(a, b);
    Report report;
    const AssetInfo& info = a.info();
    report.diagonal = std::hypot(double(info.bounds_max[0]) - info.bounds_min[0],
                                 double(info.bounds_max[1]) - info.bounds_min[1],
                                 double(info.bounds_max[2]) - info.bounds_min[2]);
    report.strands = counterparts.list_change(counterparts.strands(), Domain::strand, true);
    report.guides = counterparts.list_change(counterparts.guides(), Domain::lane, true);
    report.vertices = counterparts.list_change(counterparts.vertices(), Domain::vertex, false);
    report.triangles = counterparts.list_change(counterparts.triangles(), Domain::triangle, false);
    report.fields = compare_fields(a, b, counterparts);
    compare_info(a, b, counterparts, report);
    const auto bytes_a = a.bytes(), bytes_b = b.bytes();
    report.same_bytes = std::equal(bytes_a.begin(), bytes_a.end(), bytes_b.begin(), bytes_b.end());
    return report;
}

}  // namespace keratin::diff
