/* A headless OpenGL 4.x core context and its functions.
 *
 * The GL is loaded at run time: OSMesa (a GL in the process, no display at all) first, EGL without a surface
 * second; environment variable QUADPLAN_GL=osmesa|egl insists on one. One context at a time, used by the
 * thread that opened it. */
#ifndef QP_GL_CONTEXT_H
#define QP_GL_CONTEXT_H

#include "host/base/status.h"

#include <GL/glcorearb.h>

/* X(result, name, PFN type) of every function we call. */
#define QP_GL_FUNCTIONS(X)                                                                                   \
    X(ActiveTexture, ACTIVETEXTURE)                                                                          \
    X(AttachShader, ATTACHSHADER)                                                                            \
    X(BeginQuery, BEGINQUERY)                                                                                \
    X(BeginTransformFeedback, BEGINTRANSFORMFEEDBACK)                                                        \
    X(BindAttribLocation, BINDATTRIBLOCATION)                                                                \
    X(BindBuffer, BINDBUFFER)                                                                                \
    X(BindBufferBase, BINDBUFFERBASE)                                                                        \
    X(BindFramebuffer, BINDFRAMEBUFFER)                                                                      \
    X(BindRenderbuffer, BINDRENDERBUFFER)                                                                    \
    X(BindTexture, BINDTEXTURE)                                                                              \
    X(BindVertexArray, BINDVERTEXARRAY)                                                                      \
    X(BufferData, BUFFERDATA)                                                                                \
    X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)                                                        \
    X(Clear, CLEAR)                                                                                          \
    X(ClearColor, CLEARCOLOR)                                                                                \
    X(CompileShader, COMPILESHADER)                                                                          \
    X(CreateProgram, CREATEPROGRAM)                                                                          \
    X(CreateShader, CREATESHADER)                                                                            \
    X(DeleteBuffers, DELETEBUFFERS)                                                                          \
    X(DeleteFramebuffers, DELETEFRAMEBUFFERS)                                                                \
    X(DeleteProgram, DELETEPROGRAM)                                                                          \
    X(DeleteQueries, DELETEQUERIES)                                                                          \
    X(DeleteRenderbuffers, DELETERENDERBUFFERS)                                                              \
    X(DeleteShader, DELETESHADER)                                                                            \
    X(DeleteTextures, DELETETEXTURES)                                                                        \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS)                                                                \
    X(DepthFunc, DEPTHFUNC)                                                                                  \
    X(Disable, DISABLE)                                                                                      \
    X(DrawArrays, DRAWARRAYS)                                                                                \
    X(DrawBuffer, DRAWBUFFER)                                                                                \
    X(DrawBuffers, DRAWBUFFERS)                                                                              \
    X(DispatchCompute, DISPATCHCOMPUTE)                                                                      \
    X(DrawElements, DRAWELEMENTS)                                                                            \
    X(Enable, ENABLE)                                                                                        \
    X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY)                                                      \
    X(EndQuery, ENDQUERY)                                                                                    \
    X(EndTransformFeedback, ENDTRANSFORMFEEDBACK)                                                            \
    X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER)                                                      \
    X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D)                                                            \
    X(FramebufferTextureLayer, FRAMEBUFFERTEXTURELAYER)                                                      \
    X(GenBuffers, GENBUFFERS)                                                                                \
    X(GenFramebuffers, GENFRAMEBUFFERS)                                                                      \
    X(GenQueries, GENQUERIES)                                                                                \
    X(GenRenderbuffers, GENRENDERBUFFERS)                                                                    \
    X(GenTextures, GENTEXTURES)                                                                              \
    X(GenVertexArrays, GENVERTEXARRAYS)                                                                      \
    X(GetBufferSubData, GETBUFFERSUBDATA)                                                                    \
    X(GetError, GETERROR)                                                                                    \
    X(GetIntegerv, GETINTEGERV)                                                                              \
    X(GetProgramInfoLog, GETPROGRAMINFOLOG)                                                                  \
    X(GetProgramiv, GETPROGRAMIV)                                                                            \
    X(GetQueryObjectuiv, GETQUERYOBJECTUIV)                                                                  \
    X(GetShaderInfoLog, GETSHADERINFOLOG)                                                                    \
    X(GetShaderiv, GETSHADERIV)                                                                              \
    X(GetString, GETSTRING)                                                                                  \
    X(GetUniformLocation, GETUNIFORMLOCATION)                                                                \
    X(LinkProgram, LINKPROGRAM)                                                                              \
    X(MemoryBarrier, MEMORYBARRIER)                                                                          \
    X(PatchParameteri, PATCHPARAMETERI)                                                                      \
    X(PixelStorei, PIXELSTOREI)                                                                              \
    X(PolygonOffset, POLYGONOFFSET)                                                                          \
    X(ReadBuffer, READBUFFER)                                                                                \
    X(ReadPixels, READPIXELS)                                                                                \
    X(RenderbufferStorage, RENDERBUFFERSTORAGE)                                                              \
    X(RenderbufferStorageMultisample, RENDERBUFFERSTORAGEMULTISAMPLE)                                        \
    X(ShaderSource, SHADERSOURCE)                                                                            \
    X(TexImage2DMultisample, TEXIMAGE2DMULTISAMPLE)                                                          \
    X(TexImage3D, TEXIMAGE3D)                                                                                \
    X(TexParameteri, TEXPARAMETERI)                                                                          \
    X(TransformFeedbackVaryings, TRANSFORMFEEDBACKVARYINGS)                                                  \
    X(Uniform1f, UNIFORM1F)                                                                                  \
    X(Uniform1i, UNIFORM1I)                                                                                  \
    X(Uniform1ui, UNIFORM1UI)                                                                                \
    X(Uniform2f, UNIFORM2F)                                                                                  \
    X(Uniform3f, UNIFORM3F)                                                                                  \
    X(Uniform3fv, UNIFORM3FV)                                                                                \
    X(Uniform4f, UNIFORM4F)                                                                                  \
    X(Uniform4fv, UNIFORM4FV)                                                                                \
    X(UniformMatrix4fv, UNIFORMMATRIX4FV)                                                                    \
    X(UseProgram, USEPROGRAM)                                                                                \
    X(VertexAttribPointer, VERTEXATTRIBPOINTER)                                                              \
    X(Viewport, VIEWPORT)

typedef struct qp_gl {
#define QP_GL_MEMBER(name, TYPE) PFNGL##TYPE##PROC name;
    QP_GL_FUNCTIONS(QP_GL_MEMBER)
#undef QP_GL_MEMBER
    char backend[128];       /* "OSMesa, OpenGL 4.0 ..., llvmpipe ..." */
    const char *failed_call; /* the first call that raised a GL error, or NULL */
    GLenum failed_code;
    struct qp_gl_platform *platform;
} qp_gl;

/* Opens a context and makes it current. QP_SYSTEM with what was tried and why it failed. */
qp_status qp_gl_open(qp_gl **gl, qp_error *err);
void qp_gl_close(qp_gl *gl);

/* The one check: notes the first call after which GL has an error. */
void qp_gl_note(qp_gl *gl, const char *call);
/* QP_GL(gl, Clear(mask)) calls gl->Clear and checks it. */
#define QP_GL(gl, ...) ((gl)->__VA_ARGS__, qp_gl_note((gl), "gl" #__VA_ARGS__))
/* QP_SYSTEM, naming the call, when one has failed since the context was opened. */
qp_status qp_gl_status(const qp_gl *gl, qp_error *err);

#endif
