// Little binary files made in a test.
#pragma once

#include <cstring>
#include <string>

namespace keratin::test {

template <class T>
void append(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

template <class T>
void overwrite(std::string& bytes, std::size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

}  // namespace keratin::test
