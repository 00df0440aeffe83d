#include "exemplar/base/json_check.hpp"

#include <nlohmann/json.hpp>

namespace exemplar {
namespace {

class Checker final : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit Checker(int deepest) : deepest_(deepest) {}
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return Enter(); }
  bool key(string_t&) override { return true; }
  bool end_object() override { return Leave(); }
  bool start_array(std::size_t) override { return Enter(); }
  bool end_array() override { return Leave(); }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    fault_ = JsonFault{.too_deep = false, .byte = position};
    return false;
  }
  const std::optional<JsonFault>& fault() const { return fault_; }

 private:
  bool Enter() {
    if (++depth_ <= deepest_) return true;
    fault_ = JsonFault{.too_deep = true};
    return false;
  }
  bool Leave() {
    --depth_;
    return true;
  }

  const int deepest_;
  int depth_ = 0;
  std::optional<JsonFault> fault_;
};

}  // namespace

std::optional<JsonFault> FindJsonFault(std::string_view text, int deepest) {
  Checker checker(deepest);
  nlohmann::json::sax_parse(text, &checker);
  return checker.fault();
}

}  // namespace exemplar
