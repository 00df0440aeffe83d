#include "recorder/schema_folder.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

namespace exemplar::recorder {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SchemaFolderTest : public testing::Test {
 protected:
  SchemaFolderTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "schemas-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~SchemaFolderTest() override { std::filesystem::remove_all(folder_); }

  void Put(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }

  std::filesystem::path folder_;
};

TEST_F(SchemaFolderTest, NamesEachStructByItsModules) {
  Put("a.idl",
      "// struct Comment { };\nmodule lab { module v1 {\n  struct Point { double x; };\n"
      "  enum Kind { ONE };\n  struct Reading { Point at; };\n}; struct Outer { long n; }; };\n"
      "struct Plain { string text; };\n");
  Put("notes.txt", "struct NoIdl { };");
  const auto schemas = ReadSchemaFolder(folder_);
  ASSERT_TRUE(schemas.ok()) << schemas.error().message;
  EXPECT_EQ(schemas->size(), 4u);
  for (const char* name : {"lab::v1::Point", "lab::v1::Reading", "lab::Outer", "Plain"}) {
    EXPECT_EQ(schemas->count(name), 1u) << name;
  }
}

TEST_F(SchemaFolderTest, PutsIncludesInPlaceOnce) {
  Put("base/header.idl", "#ifndef H\n#define H\nstruct Header { long n; };\n#endif\n");
  Put("a.idl", "#include \"base/header.idl\"\nstruct A { Header h; };\n");
  Put("b.idl", "#include \"a.idl\"\n#include <base/header.idl>\nstruct B { A a; Header h; };\n");
  const auto schemas = ReadSchemaFolder(folder_);
  ASSERT_TRUE(schemas.ok()) << schemas.error().message;
  EXPECT_EQ(schemas->at("B"),
            "struct Header { long n; };\nstruct A { Header h; };\nstruct B { A a; Header h; };\n");
  EXPECT_THAT(schemas->at("A"), Not(HasSubstr("struct B")));
}

TEST_F(SchemaFolderTest, RefusesMissingIncludesContradictionsAndAbsentFolders) {
  EXPECT_EQ(ReadSchemaFolder(folder_ / "absent").error().code, ErrorCode::kNotFound);
  Put("a.idl", "#include \"gone.idl\"\nstruct A { long n; };\n");
  EXPECT_THAT(ReadSchemaFolder(folder_).error().message, HasSubstr("gone.idl"));
  Put("a.idl", "struct A { long n; };\n");
  Put("z.idl", "struct A { double n; };\n");
  EXPECT_THAT(ReadSchemaFolder(folder_).error().message, HasSubstr("z.idl: declares A"));
}

}  // namespace
}  // namespace exemplar::recorder
