#include "tests/xml.h"

#include <catch2/catch.hpp>

#include <cctype>
#include <stdexcept>

namespace keratin::test {
namespace {

class Reader {
  public:
    explicit Reader(const std::string& text) : text_(text) {}

    XmlElement root() {
        XmlElement element = read();
        while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
        if (at_ != text_.size()) fail("something follows the root element");
        return element;
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error("byte " + std::to_string(at_) + ": " + what);
    }
    bool is(const std::string& what) const { return text_.compare(at_, what.size(), what) == 0; }
    void expect(const std::string& what) {
        if (!is(what)) fail("wants " + what);
        at_ += what.size();
    }
    std::string name() {
        const std::size_t start = at_;
        while (at_ < text_.size() &&
               (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '-'))
            ++at_;
        if (at_ == start) fail("wants a name");
        return text_.substr(start, at_ - start);
    }
    std::string characters(char end) {
        std::string out;
        while (at_ < text_.size() && text_[at_] != end) {
            const char c = text_[at_];
            if (c == '<') fail("< stands in an attribute");
            if (static_cast<unsigned char>(c) < 0x20 && c != '\n') fail("a control character");
            if (c == '&') {
                out += entity();
            } else {
                out += c;
                ++at_;
            }
        }
        if (at_ == text_.size()) fail("ends too early");
        return out;
    }
    char entity() {
        const std::pair<const char*, char> known[] = {
            {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
        for (const auto& [written, meant] : known)
            if (is(written)) {
                at_ += std::string(written).size();
                return meant;
            }
        fail("an unknown entity");
    }
    XmlElement read() {
        XmlElement element;
        expect("<");
        element.name = name();
        while (is(" ")) {
            ++at_;
            const std::string attribute = name();
            expect("=\"");
            if (!element.attributes.emplace(attribute, characters('"')).second)
                fail(attribute + " stands there twice");
            expect("\"");
        }
        if (is("/>")) {
            at_ += 2;
            return element;
        }
        expect(">");
        for (;;) {
            element.text += characters('<');
            if (is("</")) break;
            element.inside.push_back(read());
            element.text += element.inside.back().text;
        }
        expect("</" + element.name + ">");
        return element;
    }

    const std::string& text_;
    std::size_t at_ = 0;
};

}  // namespace

double XmlElement::number(const std::string& attribute) const {
    CAPTURE(name, attribute);
    REQUIRE(attributes.count(attribute));
    std::size_t read = 0;
    const double value = std::stod(attributes.at(attribute), &read);
    REQUIRE(read == attributes.at(attribute).size());
    return value;
}

std::vector<const XmlElement*> XmlElement::all(const std::string& wanted) const {
    std::vector<const XmlElement*> found;
    for (const XmlElement& element : inside) {
        if (element.name == wanted) found.push_back(&element);
        const auto deeper = element.all(wanted);
        found.insert(found.end(), deeper.begin(), deeper.end());
    }
    return found;
}

XmlElement read_xml(const std::string& text) { return Reader(text).root(); }

}  // namespace keratin::test
