// The page's files before a real HTTP server.

#include "gateway/static_pages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "gateway/robot_pages.hpp"
#include "unit/http/raw_client.hpp"

namespace exemplar::gateway {
namespace {

namespace fs = std::filesystem;
using http::testing::Reply;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Key;
using ::testing::Not;

class StaticPagesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "exemplar-pages-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = fs::path(name) / "web";
    Write("index.html", "<!doctype html>");
    Write("app.js", "export {};");
    Write("app.js.gz", "packed");
    Write("meshes/hand.STL", "solid");
    Write("robot.yaml", "secret: 1");
    Write(".hidden/app.js", "hidden");
    Write("../outside.html", "outside");
    fs::create_symlink(folder_.parent_path() / "outside.html", folder_ / "link.html");
  }
  void TearDown() override { fs::remove_all(folder_.parent_path()); }

  void Write(const std::string& path, const std::string& text) const {
    fs::create_directories((folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text;
  }
  StaticFiles Read() const {
    auto files = ReadStaticFiles(folder_);
    EXPECT_TRUE(files.ok());
    return std::move(*files);
  }
  void Serve() {
    server_ = *http::Server::Create({}, log_);
    ASSERT_TRUE(AddPage(*server_, Read()).ok());
    ASSERT_TRUE(AddFiles(*server_, "/robot/files/", Read()).ok());
    server_->Start();
  }
  Reply Ask(const std::string& line, const std::string& fields = {}) const {
    return http::testing::Ask(server_->port(), line, fields);
  }

  fs::path folder_;
  NullLog log_;
  std::unique_ptr<http::Server> server_;
};

TEST_F(StaticPagesTest, ReadsWhatBrowsersNeedAndFollowsNoLinks) {
  EXPECT_THAT(Read(), ElementsAre(Key("app.js"), Key("index.html"), Key("meshes/hand.STL")));
  EXPECT_EQ(ReadStaticFiles(folder_ / "none").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ReadStaticFiles(folder_, {.files = 1}).error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(ReadStaticFiles(folder_, {.bytes = 16}).error().code, ErrorCode::kResourceExhausted);
}

TEST_F(StaticPagesTest, ServesThePageWithHeadersThatKeepItToItself) {
  Serve();
  const Reply page = Ask("GET /");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.body, "<!doctype html>");
  EXPECT_THAT(page.head, HasSubstr("Content-Type: text/html; charset=utf-8\r\n"));
  EXPECT_THAT(page.head,
              HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"));
  EXPECT_THAT(page.head, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(page.head, Not(HasSubstr("unsafe")));
  EXPECT_THAT(page.head, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
  EXPECT_THAT(Ask("GET /app.js").head, HasSubstr("Content-Type: text/javascript"));
}

TEST_F(StaticPagesTest, SendsNothingAgainThatTheBrowserHas) {
  Serve();
  const std::string etag = Read().at("app.js").etag;
  const Reply same = Ask("GET /app.js", "If-None-Match: \"other\", W/" + etag + "\r\n");
  EXPECT_EQ(same.status, 304);
  EXPECT_EQ(same.body, "");
  EXPECT_EQ(Ask("GET /app.js", "If-None-Match: \"other\"\r\n").status, 200);
}

TEST_F(StaticPagesTest, SendsThePackedFormToWhoTakesIt) {
  Serve();
  const Reply packed = Ask("GET /app.js", "Accept-Encoding: br, gzip\r\n");
  EXPECT_EQ(packed.body, "packed");
  EXPECT_THAT(packed.head, HasSubstr("Content-Encoding: gzip\r\n"));
  EXPECT_EQ(Ask("GET /app.js", "Accept-Encoding: gzip;q=0\r\n").body, "export {};");
}

TEST_F(StaticPagesTest, NothingElseIsServedWhateverThePath) {
  Serve();
  EXPECT_EQ(Ask("GET /robot/files/meshes/hand.STL").body, "solid");
  for (const char* path :
       {"/robot/files/robot.yaml", "/robot/files/link.html", "/robot/files/.hidden/app.js",
        "/robot/files/../outside.html", "/robot/files/%2e%2e/outside.html",
        "/robot/files/..%2foutside.html", "/robot/files//etc/passwd",
        "/robot/files/%2fetc%2fpasswd", "/outside.html", "/app.js.gz", "/app.js/", "/meshes"}) {
    const Reply reply = Ask(std::string("GET ") + path);
    EXPECT_TRUE(reply.status == 400 || reply.status == 404) << path << ": " << reply.status;
  }
}

TEST_F(StaticPagesTest, SaysHowToBuildAPageThatIsNotThere) {
  fs::remove(folder_ / "index.html");
  server_ = *http::Server::Create({}, log_);
  EXPECT_FALSE(AddPage(*server_, Read()).ok());
  ASSERT_TRUE(AddPageMissing(*server_, "/somewhere/web").ok());
  server_->Start();
  EXPECT_THAT(Ask("GET /").body, AllOf(HasSubstr("deploy/build"), HasSubstr("/somewhere/web")));
}

TEST(RobotPages, TellsARobotByPathsThatItsFilesHave) {
  const auto robot = kinematics::ReadRobotDescription(fs::path(EXEMPLAR_SOURCE_DIR) / "deploy" /
                                                      "models" / "leonardo");
  ASSERT_TRUE(robot.ok());
  const auto files = RobotFiles(*robot);
  ASSERT_TRUE(files.ok());
  EXPECT_THAT(*files, ElementsAre(Key("leonardo.urdf")));
  const std::string json = RobotJson(*robot, *files);
  EXPECT_THAT(json, AllOf(HasSubstr(R"("base":"pelvis")"), HasSubstr(R"("tip":"tool")"),
                          HasSubstr(R"("urdf":"leonardo.urdf")"),
                          HasSubstr(R"("right_elbow_in_out":1.63)")));
}

TEST(RobotPages, TellsASceneByItsShapesAndNamesWhatHasNone) {
  const auto scene = scene::ParseDescription(
      "obstacles:\n  - {name: table, shape: box, size: [1, 2, 0.04], position: [0.5, 0, -0.02]}\n"
      "buttons:\n  - {name: target, position: [0.4, 0, 0.04], radius: 0.02, height: 0.03}\n",
      "scene.yaml");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const std::string json = SceneJson(*scene);
  EXPECT_THAT(
      json, HasSubstr(R"({"name":"table","kind":"obstacle","shape":"box","size":[1.0,2.0,0.04])"));
  EXPECT_THAT(
      json,
      HasSubstr(R"("shape":"cylinder","size":[0.02,0.03],"pose":{"position":[0.4,0.0,0.04])"));
  EXPECT_THAT(json, HasSubstr(R"("offset":{"position":[0.0,0.0,-0.015])"));
  EXPECT_THAT(json, HasSubstr(R"("left_out":[])"));
}

}  // namespace
}  // namespace exemplar::gateway
