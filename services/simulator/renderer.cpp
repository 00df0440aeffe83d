#include "simulator/renderer.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <string>

#include "simulator/mjcf_writer.hpp"
#include "simulator/mujoco_rows.hpp"

namespace exemplar::simulator {
namespace {

constexpr int kLargestScene = 4000;  // geoms

/// An OpenGL context without window or screen, current on the thread that made it.
class OffscreenContext {
 public:
  static Result<std::unique_ptr<OffscreenContext>> Create() {
    std::unique_ptr<OffscreenContext> made(new OffscreenContext);
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display == nullptr) return Unavailable("EGL: no platform displays");
    made->display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (made->display_ == EGL_NO_DISPLAY) return Failed("no display without a surface");
    EGLint major = 0;
    EGLint minor = 0;
    if (eglInitialize(made->display_, &major, &minor) != EGL_TRUE) return Failed("not initialised");
    made->initialised_ = true;
    const EGLint wanted[] = {EGL_SURFACE_TYPE,
                             EGL_PBUFFER_BIT,
                             EGL_RENDERABLE_TYPE,
                             EGL_OPENGL_BIT,
                             EGL_RED_SIZE,
                             8,
                             EGL_GREEN_SIZE,
                             8,
                             EGL_BLUE_SIZE,
                             8,
                             EGL_DEPTH_SIZE,
                             24,
                             EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(made->display_, wanted, &config, 1, &count) != EGL_TRUE || count < 1) {
      return Failed("no configuration with OpenGL");
    }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return Failed("no OpenGL");
    made->context_ = eglCreateContext(made->display_, config, EGL_NO_CONTEXT, nullptr);
    if (made->context_ == EGL_NO_CONTEXT) return Failed("no context");
    if (eglMakeCurrent(made->display_, EGL_NO_SURFACE, EGL_NO_SURFACE, made->context_) !=
        EGL_TRUE) {
      return Failed("context cannot be made current");
    }
    return made;
  }

  ~OffscreenContext() {
    if (!initialised_) return;
    // The display is shared by the whole process and stays.
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  }
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  OffscreenContext() = default;
  static Error Failed(const std::string& what) {
    return Unavailable("EGL: " + what + " (error " + std::to_string(eglGetError()) + ")");
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  bool initialised_ = false;
};

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

}  // namespace

struct Renderer::Impl {
  std::unique_ptr<OffscreenContext> gl;  ///< first: goes last
  std::unique_ptr<mjModel, ModelDeleter> model;
  std::unique_ptr<mjData, DataDeleter> data;
  mjvScene scene;
  mjrContext context;
  mjvOption look;

  Impl(std::unique_ptr<OffscreenContext> gl_context, const mjModel* source)
      : gl(std::move(gl_context)),
        model(mj_copyModel(nullptr, source)),
        data(mj_makeData(model.get())) {
    mjv_defaultOption(&look);
    mjv_defaultScene(&scene);
    mjv_makeScene(model.get(), &scene, kLargestScene);
    scene.flags[mjRND_SHADOW] = 0;
    scene.flags[mjRND_REFLECTION] = 0;
    mjr_defaultContext(&context);
    mjr_makeContext(model.get(), &context, mjFONTSCALE_100);
    mjr_setBuffer(mjFB_OFFSCREEN, &context);
  }
  ~Impl() {
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void Pose(const Snapshot& snapshot) {
    std::copy(snapshot.positions.begin(), snapshot.positions.end(), data->qpos);
    for (int i = 0; i < model->nmocap; ++i) {
      const double* pose = Row(snapshot.thing_poses.data(), 7, i);
      std::copy_n(pose, 3, Row(data->mocap_pos, 3, i));
      std::copy_n(pose + 3, 4, Row(data->mocap_quat, 4, i));
    }
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
    mj_camlight(model.get(), data.get());
  }

  perception::Picture DrawEye(const std::string& name, int width, int height) {
    mjvCamera camera;
    mjv_defaultCamera(&camera);
    camera.type = mjCAMERA_FIXED;
    camera.fixedcamid = mj_name2id(model.get(), mjOBJ_CAMERA, name.c_str());
    mjvPerturb nothing;
    mjv_defaultPerturb(&nothing);
    mjv_updateScene(model.get(), data.get(), &look, &nothing, &camera, mjCAT_ALL, &scene);
    const mjrRect viewport = {0, 0, width, height};
    mjr_render(viewport, &scene, &context);
    perception::Picture picture{width, height, {}};
    const std::size_t row = 3 * static_cast<std::size_t>(width);
    std::vector<std::uint8_t> upside_down(row * static_cast<std::size_t>(height));
    mjr_readPixels(upside_down.data(), nullptr, viewport, &context);
    picture.rgb.reserve(upside_down.size());
    for (std::size_t y = static_cast<std::size_t>(height); y-- > 0;) {
      const auto begin = upside_down.begin() + static_cast<std::ptrdiff_t>(y * row);
      picture.rgb.insert(picture.rgb.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
    }
    return picture;
  }
};

Renderer::Renderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::Create(const World& world) {
  Result<std::unique_ptr<OffscreenContext>> gl = OffscreenContext::Create();
  if (!gl) return gl.error();
  auto impl = std::make_unique<Impl>(std::move(gl).value(), world.model());
  if (impl->context.currentBuffer != mjFB_OFFSCREEN) {
    return Unavailable("OpenGL: no buffer to draw into");
  }
  return Renderer(std::move(impl));
}

std::pair<perception::Picture, perception::Picture> Renderer::Draw(
    const Snapshot& snapshot, const scene::StereoCamera& camera) {
  impl_->Pose(snapshot);
  perception::Picture left =
      impl_->DrawEye(EyeName(camera.name, false), camera.width, camera.height);
  perception::Picture right =
      impl_->DrawEye(EyeName(camera.name, true), camera.width, camera.height);
  return {std::move(left), std::move(right)};
}

}  // namespace exemplar::simulator
