#include "tools/keratin-report/print.h"

#include <cstdio>

namespace keratin::report {

namespace {

std::string number(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof(text), format, value);
    return text;
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') out += "&amp;";
        else if (c == '<') out += "&lt;";
        else if (c == '>') out += "&gt;";
        else if (c == '"') out += "&quot;";
        else out += c;
    }
    return out;
}

const char* verdict(const Outcome& o) {
    return !o.not_applicable.empty() ? "not applicable" : o.passed() ? "pass" : "FAIL";
}

std::string check_text(const Check& c) {
    char text[256];
    std::snprintf(text, sizeof(text), "    %-38s measured %-14.8g reference %-14.8g error %-10.3g tolerance %-9.3g %s\n",
                  c.what.c_str(), c.measured, c.reference, c.error, c.tolerance, c.passed() ? "pass" : "FAIL");
    return text;
}

}  // namespace

std::string outcome_text(const Outcome& o) {
    std::string text = o.id + ": " + verdict(o);
    if (!o.not_applicable.empty()) return text + " (" + o.not_applicable + ")\n";
    text += number(" (%.2f s)\n", o.seconds);
    for (const Check& c : o.checks) text += check_text(c);
    return text;
}

std::string summary_text(const std::vector<Outcome>& outcomes) {
    std::size_t passed = 0, skipped = 0;
    for (const Outcome& o : outcomes) {
        passed += o.passed();
        skipped += !o.not_applicable.empty();
    }
    return std::to_string(passed) + " passed, " + std::to_string(outcomes.size() - passed - skipped) + " failed, " +
           std::to_string(skipped) + " not applicable\n";
}

std::string outcomes_json(const std::string& command, const std::string& solver, const std::vector<Outcome>& outcomes) {
    // JSON has no word for "not a number": null stands for it
    const auto finite = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
    Json cases = Json::array();
    for (const Outcome& o : outcomes) {
        Json checks = Json::array();
        for (const Check& c : o.checks)
            checks.push_back({{"what", c.what}, {"measured", finite(c.measured)}, {"reference", finite(c.reference)},
                              {"error", finite(c.error)}, {"tolerance", finite(c.tolerance)}, {"passed", c.passed()}});
        Json one = {{"id", o.id}, {"family", o.family}, {"seconds", o.seconds}, {"checks", checks},
                    {"result", o.not_applicable.empty() ? (o.passed() ? "pass" : "fail") : "not_applicable"}};
        if (!o.not_applicable.empty()) one["reason"] = o.not_applicable;
        cases.push_back(one);
    }
    const Json document = {{"command", command}, {"solver", solver}, {"version", KERATIN_VERSION},
                           {"passed", all_passed(outcomes)}, {"cases", cases}};
    return document.dump(1) + "\n";
}

std::string outcomes_junit(const std::string& command, const std::vector<Outcome>& outcomes) {
    std::size_t failures = 0, skipped = 0;
    double seconds = 0;
    std::string body;
    for (const Outcome& o : outcomes) {
        body += "  <testcase classname=\"" + escaped(o.family) + "\" name=\"" + escaped(o.id) + "\" time=\"" +
                number("%.3f", o.seconds) + "\">\n";
        if (!o.not_applicable.empty()) {
            ++skipped;
            body += "    <skipped message=\"" + escaped(o.not_applicable) + "\"/>\n";
        } else if (!o.passed()) {
            ++failures;
            std::string text;
            for (const Check& c : o.checks)
                if (!c.passed()) text += check_text(c);
            body += "    <failure message=\"out of tolerance\">" + escaped(text) + "</failure>\n";
        }
        body += "  </testcase>\n";
        seconds += o.seconds;
    }
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"keratin-report " + escaped(command) +
           "\" tests=\"" + std::to_string(outcomes.size()) + "\" failures=\"" + std::to_string(failures) +
           "\" skipped=\"" + std::to_string(skipped) + "\" time=\"" + number("%.3f", seconds) + "\">\n" + body +
           "</testsuite>\n";
}

bool all_passed(const std::vector<Outcome>& outcomes) {
    for (const Outcome& o : outcomes)
        if (o.not_applicable.empty() && !o.passed()) return false;
    return true;
}

}  // namespace keratin::report
