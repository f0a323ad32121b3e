// Reads XML as far as our own pictures use it: elements, attributes, text, the five entities.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace keratin::test {

struct XmlElement {
    std::string name, text;  // text of its own and of what is inside, entities resolved
    std::map<std::string, std::string> attributes;
    std::vector<XmlElement> inside;

    double number(const std::string& attribute) const;  // fails the test when it is none
    // All elements of that name inside, however deep, in their order.
    std::vector<const XmlElement*> all(const std::string& wanted) const;
};

// The one root element; throws std::runtime_error, saying where, when the text is not well-formed.
XmlElement read_xml(const std::string& text);

}  // namespace keratin::test
