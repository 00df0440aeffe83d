#include "exemplar/base/xml.hpp"

#include <gtest/gtest.h>

namespace exemplar {
namespace {

TEST(EscapeXml, ReplacesWhatXmlGivesAMeaning) {
  EXPECT_EQ(EscapeXml("a < b && \"c\" > d"), "a &lt; b &amp;&amp; &quot;c&quot; &gt; d");
  EXPECT_EQ(EscapeXml("a\tb\nc\x01"
                      "d"),
            "a\tb\nc d");
  EXPECT_EQ(EscapeXml("Gr\xc3\xbc\xc3\x9f"
                      "e"),
            "Gr\xc3\xbc\xc3\x9f"
            "e");
  EXPECT_EQ(EscapeXml(""), "");
}

}  // namespace
}  // namespace exemplar
