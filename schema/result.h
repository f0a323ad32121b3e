// How a function tells its caller that the outside world was wrong: Result<T> holds a value or an
// Error whose text helps the one who must fix it. Mistakes that only our own code can make are
// asserts, not errors.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace keratin {

enum class ErrorCode {
    usage,        // the call or the command line is wrong
    input,        // a file, a recipe, a scene or an argument holds something that cannot be used
    io,           // the system refused to read or write
    unsupported,  // right, but not in this build or not for this solver
    internal,     // ours
};

// where    file, then the place in it: "head.kera", "groom.json:12:5", "hair.tfx: strand 1207"
// message  what is wrong and what would be right, without a final full stop
struct Error {
    ErrorCode code = ErrorCode::internal;
    std::string where;
    std::string message;
};

// "where: message"
inline std::string to_string(const Error& error) {
    return error.where.empty() ? error.message : error.where + ": " + error.message;
}

// Exit code of the programs: 2 wrong usage or bad input, 3 an internal fault.
inline int exit_code(const Error& error) { return error.code == ErrorCode::internal ? 3 : 2; }

template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    explicit operator bool() const { return state_.index() == 0; }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T&& operator*() && { return std::move(value()); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }

    T& value() & {
        assert(*this);
        return std::get<0>(state_);
    }
    const T& value() const& {
        assert(*this);
        return std::get<0>(state_);
    }
    T&& value() && {
        assert(*this);
        return std::get<0>(std::move(state_));
    }
    const Error& error() const {
        assert(!*this);
        return std::get<1>(state_);
    }

  private:
    std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
  public:
    Result() = default;
    Result(Error error) : error_(std::move(error)), failed_(true) {}

    explicit operator bool() const { return !failed_; }
    const Error& error() const {
        assert(failed_);
        return error_;
    }

  private:
    Error error_;
    bool failed_ = false;
};

}  // namespace keratin
