#pragma once
// Expected failures as values. Broken contracts assert; only main() ends a process.

#include <array>
#include <cassert>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace exemplar {

/// What kind of failure an Error is. The command line and gRPC map each kind to their own codes.
enum class ErrorCode {
  kInvalidArgument,     ///< The input is wrong, whatever the state of the system.
  kNotFound,            ///< A named thing does not exist.
  kAlreadyExists,       ///< A thing of that name exists and may not be replaced.
  kFailedPrecondition,  ///< Refused as unsafe, or not possible in the present state.
  kUnavailable,         ///< Somebody else does not answer; trying again may help.
  kResourceExhausted,   ///< Disk, memory or a queue is full.
  kDeadlineExceeded,    ///< Not done in time.
  kCancelled,           ///< The caller asked to stop.
  kDataLoss,            ///< Stored data is damaged.
  kInternal,            ///< A fault of ours.
  kUnauthenticated,     ///< Who calls did not show who he is: no token, or one that is not known.
  kPermissionDenied,    ///< Who calls is known, and may not do this.
  kUnimplemented,       ///< Not served here: another service, or one of another version.
};

inline constexpr std::array kErrorCodes = {
    ErrorCode::kInvalidArgument,    ErrorCode::kNotFound,        ErrorCode::kAlreadyExists,
    ErrorCode::kFailedPrecondition, ErrorCode::kUnavailable,     ErrorCode::kResourceExhausted,
    ErrorCode::kDeadlineExceeded,   ErrorCode::kCancelled,       ErrorCode::kDataLoss,
    ErrorCode::kInternal,           ErrorCode::kUnauthenticated, ErrorCode::kPermissionDenied,
    ErrorCode::kUnimplemented};

/// The stable lower-case name of a code, as JSON output and logs print it ("not_found").
std::string_view ToString(ErrorCode code);
/// The code of a name, as ToString gives it.
std::optional<ErrorCode> ParseErrorCode(std::string_view name);

/// A failure: what was wrong, and where.
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  /// A sentence for a person that holds the value and its place:
  /// `trial.csv:14: ee_qw: "nan" is not a number`.
  std::string message;
  /// The input at fault as a program would name it ("objects[0].position"), or empty.
  std::string field = {};

  friend bool operator==(const Error&, const Error&) = default;
};

/// The same error with `place: ` before its message.
Error WithPlace(Error error, std::string_view place);

inline Error InvalidArgument(std::string message, std::string field = {}) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(field)};
}
inline Error NotFound(std::string message, std::string field = {}) {
  return {ErrorCode::kNotFound, std::move(message), std::move(field)};
}
inline Error FailedPrecondition(std::string message, std::string field = {}) {
  return {ErrorCode::kFailedPrecondition, std::move(message), std::move(field)};
}
inline Error Unavailable(std::string message) {
  return {ErrorCode::kUnavailable, std::move(message)};
}
inline Error Unauthenticated(std::string message, std::string field = {}) {
  return {ErrorCode::kUnauthenticated, std::move(message), std::move(field)};
}
inline Error PermissionDenied(std::string message, std::string field = {}) {
  return {ErrorCode::kPermissionDenied, std::move(message), std::move(field)};
}
inline Error Internal(std::string message) { return {ErrorCode::kInternal, std::move(message)}; }

/// A value of type T or an Error. Thread-compatible.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT: implicit on purpose
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// Precondition: ok().
  T& value() & {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  const T& value() const& {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  T&& value() && {
    assert(ok());
    return std::move(*std::get_if<0>(&state_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  /// Precondition: !ok().
  const Error& error() const {
    assert(!ok());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Success, or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    assert(!ok());
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace exemplar
