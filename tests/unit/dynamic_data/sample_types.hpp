#pragma once
// Types and samples, put together by hand from the rules of CDR.

#include <cstring>
#include <string>
#include <vector>

namespace exemplar::dynamic_data {

inline constexpr const char* kIdl = R"(
// A comment; /* not a comment */
#pragma once
module lab { module v1 {
  const long kAxes = 2 + 1;
  const string kNote = "unused } text";
  enum Mode { OFF, @value(5) ON, AUTO };
  typedef double Vector[kAxes];
  @final
  struct Point { Vector at; };
  union Shape switch (Mode) {
    case OFF: case ON: long edges;
    default: string<8> name;
  };
  @final @nested(FALSE)
  struct Sample {
    @key string source;
    unsigned long long seq;
    Mode mode;
    boolean good;
    char letter;
    sequence<octet> bytes;
    octet fixed[3];
    sequence<Point, 4> points;
    Shape shape;
    float ratio;
    short grid[2][2];
  };
}; };
)";

/// Writes CDR: numbers at multiples of their size.
class Cdr {
 public:
  explicit Cdr(bool little_endian = true, std::size_t most_alignment = 8, std::uint8_t kind = 0)
      : little_endian_(little_endian), most_alignment_(most_alignment) {
    bytes_ = {0, static_cast<std::uint8_t>(kind + (little_endian ? 1 : 0)), 0, 0};
  }
  template <class Number>
  Cdr& Put(Number value) {
    const std::size_t alignment = std::min(sizeof value, most_alignment_);
    while ((bytes_.size() - 4) % alignment != 0) bytes_.push_back(0);
    std::uint8_t raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    for (std::size_t i = 0; i < sizeof value; ++i) {
      bytes_.push_back(raw[little_endian_ ? i : sizeof value - 1 - i]);
    }
    return *this;
  }
  Cdr& Text(const std::string& text) {
    Put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  std::vector<std::uint8_t> bytes() const { return bytes_; }

 private:
  bool little_endian_;
  std::size_t most_alignment_;
  std::vector<std::uint8_t> bytes_;
};

inline std::vector<std::uint8_t> SampleBytes(bool little_endian = true) {
  Cdr cdr(little_endian);
  cdr.Text("arm \"left\"").Put(std::uint64_t{18446744073709551615U}).Put(std::int32_t{5});
  cdr.Put(std::uint8_t{1}).Put('x');
  cdr.Put(std::uint32_t{4});
  for (const int byte : {0, 255, 16, 7}) cdr.Put(static_cast<std::uint8_t>(byte));
  for (const int byte : {1, 2, 3}) cdr.Put(static_cast<std::uint8_t>(byte));
  cdr.Put(std::uint32_t{1}).Put(0.1).Put(-2.5).Put(1e300);
  cdr.Put(std::int32_t{6}).Text("ring");
  cdr.Put(0.5F);
  for (const int cell : {1, -2, 3, -4}) cdr.Put(static_cast<std::int16_t>(cell));
  return cdr.bytes();
}

inline constexpr const char* kSampleJson =
    R"({"source":"arm \"left\"","seq":18446744073709551615,"mode":"ON","good":true,"letter":"x",)"
    R"("bytes":"AP8QBw==","fixed":"AQID","points":[{"at":[0.1,-2.5,1e+300]}],)"
    R"("shape":{"_d":"AUTO","name":"ring"},"ratio":0.5,"grid":[[1,-2],[3,-4]]})";

}  // namespace exemplar::dynamic_data
