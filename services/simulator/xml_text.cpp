#include "simulator/xml_text.hpp"

#include <cassert>

#include "exemplar/base/text.hpp"
#include "exemplar/base/xml.hpp"

namespace exemplar::simulator {

Attribute::Attribute(std::string_view attribute_name, double number)
    : name(attribute_name), value(FormatDouble(number)) {}

Attribute::Attribute(std::string_view attribute_name, std::initializer_list<double> numbers)
    : name(attribute_name) {
  for (const double number : numbers) {
    if (!value.empty()) value += ' ';
    value += FormatDouble(number);
  }
}

Attributes PoseAttributes(const geometry::Pose& pose) {
  return {{"pos", pose.translation}, {"quat", pose.rotation}};
}

Attributes operator+(Attributes a, const Attributes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void XmlText::Start(std::string_view element, const Attributes& attributes, std::string_view end) {
  text_.append(2 * open_.size(), ' ');
  text_ += '<';
  text_ += element;
  for (const Attribute& attribute : attributes) {
    text_ += ' ' + attribute.name + "=\"" + EscapeXml(attribute.value) + '"';
  }
  text_ += end;
}

void XmlText::Open(std::string_view element, const Attributes& attributes) {
  Start(element, attributes, ">\n");
  open_.emplace_back(element);
}

void XmlText::Close() {
  assert(!open_.empty());
  const std::string element = open_.back();
  open_.pop_back();
  text_.append(2 * open_.size(), ' ');
  text_ += "</" + element + ">\n";
}

void XmlText::Empty(std::string_view element, const Attributes& attributes) {
  Start(element, attributes, "/>\n");
}

std::string XmlText::Take() && {
  assert(open_.empty());
  return std::move(text_);
}

}  // namespace exemplar::simulator
