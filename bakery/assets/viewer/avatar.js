var D=Math.PI/180;function At([r,t,o]){let e=Math.hypot(r,t,o);if(e<1e-12)return[1,0,0,0,1,0,0,0,1];[r,t,o]=[r/e,t/e,o/e];let n=Math.cos(e),s=Math.sin(e),i=1-n;return[n+r*r*i,r*t*i-o*s,r*o*i+t*s,t*r*i+o*s,n+t*t*i,t*o*i-r*s,o*r*i-t*s,o*t*i+r*s,n+o*o*i]}function H(r,t,o=0){let[e,n]=[Math.cos(r*D),Math.sin(r*D)],[s,i]=[Math.cos(t*D),Math.sin(t*D)],[c,a]=[Math.cos(-o*D),Math.sin(-o*D)],h=X([e,0,n,0,1,0,-n,0,e],[1,0,0,0,s,-i,0,i,s]);return X(h,[c,-a,0,a,c,0,0,0,1])}function X(r,t){let o=new Array(9);for(let e=0;e<3;e++)for(let n=0;n<3;n++)o[3*e+n]=r[3*e]*t[n]+r[3*e+1]*t[3+n]+r[3*e+2]*t[6+n];return o}var P=(r,[t,o,e])=>[r[0]*t+r[1]*o+r[2]*e,r[3]*t+r[4]*o+r[5]*e,r[6]*t+r[7]*o+r[8]*e];function S(r){let{focal:t,center:o,translation:e,width:n,height:s}=r;return{rotation:At(r.rotation),translation:e,focal:t,center:o,width:n,height:s}}function K(r,t,o,e){let s=P(r.rotation,e).map((a,h)=>a+r.translation[h]),i=H(t,o),c=P(i,e);return{...r,rotation:i,translation:s.map((a,h)=>a-c[h])}}function I(r,t,o,e,n,s=[0,0]){return{...r,focal:r.focal*o,center:[(r.center[0]-t[0])*o+e/2+s[0],(r.center[1]-t[1])*o+n/2+s[1]],width:e,height:n}}function Z(r,t,o){let e=P(t,o),n=P(r.rotation,o.map((s,i)=>s-e[i]));return{...r,rotation:X(r.rotation,t),translation:r.translation.map((s,i)=>s+n[i])}}function L(r,t){let[o,e,n]=P(r.rotation,t).map((i,c)=>i+r.translation[c]),s=r.focal/-n;return[r.center[0]+o*s,r.center[1]-e*s,-n]}function q({rotation:r,translation:t}){return new Float32Array([r[0],r[3],r[6],0,r[1],r[4],r[7],0,r[2],r[5],r[8],0,t[0],t[1],t[2],1])}function J({focal:r,center:t,width:o,height:e,translation:n}){let s=-n[2],i=Math.max(s-450,s*.05,1),c=s+550;return new Float32Array([2*r/o,0,0,0,0,2*r/e,0,0,1-2*t[0]/o,2*t[1]/e-1,-(c+i)/(c-i),-1,0,0,-2*c*i/(c-i),0])}var E=class extends Error{},Tt=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,_t=64*2**20,Rt=256*2**20,bt=16384,T=52,Q=8;async function et(r){let t=new URL(r.endsWith("/")?r:r+"/",document.baseURI),o=async s=>{let i=await fetch(new URL(s,t));if(!i.ok)throw new E(`${s}: ${i.status} ${i.statusText}`);return new Uint8Array(await i.arrayBuffer())},e=s=>JSON.parse(new TextDecoder().decode(s)),n=e(await o("avatar.json"));return Array.isArray(n.files)?{description:e(await o("web/avatar.json")),file:s=>o("web/"+s)}:{description:n,file:o}}function ot(r){let t=(s,i)=>{if(!s)throw new E(`the bundle's web/avatar.json: ${i}; bake it again`)};t(r&&r.$schema==="urn:bakery:schema:web-1","of another version"),t(st(r),"holds a number that is none");let o=r.expressions;t(Array.isArray(o)&&o.length===T,"lacks the 52 expressions"),t(o.every(s=>/^[A-Za-z]{1,40}$/.test(s)),"has an odd expression"),t(r.keys?.length>=1&&r.keys.length<=Q,`needs 1 to ${Q} keys`),t(r.keys.every(s=>_(s.weights,T)),"keys lack weights"),t(_(r.lips?.rest,80)&&r.lips.shapes?.length===T,"lacks the lips"),t(r.lips.shapes.every(s=>_(s,80)),"lacks the lips"),t(r.mouths?.length>=1&&r.mouths.length<=300,"needs 1 to 300 mouths"),t(r.mouths.every(s=>_(s,80)),"mouths lack landmarks"),t(r.gaze?.length>=1&&r.gaze.every(s=>_(s,2)),"lacks gaze"),t(_(r.pose?.weights,T),"lacks the pose of the photo"),t(_(r.pivot,3)&&r.light?.length===9,"lacks its frame"),t(r.eyes?.cap>0&&_(r.eyes.degrees,2),"lacks eyes"),t(r.eyes.centers?.length===2&&r.eyes.centers.every(s=>_(s,3)),"lacks eyes");for(let s of["photo_camera","front_camera"]){let i=r[s];t(i&&i.focal>0&&_(i.center,2),`lacks ${s}`),t(_(i.rotation,3)&&_(i.translation,3),`lacks ${s}`),t(i.width>0&&i.height>0,`lacks ${s}`)}for(let s of["mouth_sheet","eye_cap_left","eye_cap_right"])t(_(r.uv?.[s],4),`lacks the place of ${s}`);let e=["neutral",...r.keys.map(s=>s.name),"gaze","mouths","masks","coverage"];for(let s of e)t(Object.hasOwn(r.atlases??{},s),"lacks a picture");for(let s of Object.values(r.atlases))t(Tt.test(s.file??""),"names a file outside of its folder"),t(tt(s.columns)&&tt(s.rows),"has an odd grid"),t(s.names?.length<=s.columns*s.rows,"has an odd grid");let n=(s,i)=>t(r.atlases[s].names.length===i,`${s} differ in number`);n("gaze",r.gaze.length),n("mouths",r.mouths.length),n("masks",T)}var _=(r,t)=>Array.isArray(r)&&r.length===t&&r.every(o=>typeof o=="number"),tt=r=>Number.isInteger(r)&&r>=1&&r<=1024;function st(r){return typeof r=="number"?Number.isFinite(r):r&&typeof r=="object"?Object.values(r).every(st):!0}function kt(r){let t=new DataView(r.buffer,r.byteOffset,r.byteLength),o=e=>String.fromCharCode(...r.subarray(e,e+4));if(r.length>24&&t.getUint32(0)===2303741511)return[t.getUint32(16),t.getUint32(20)];if(r.length>30&&o(0)==="RIFF"&&o(8)==="WEBP"){let e=o(12);if(e==="VP8 ")return[t.getUint16(26,!0)&16383,t.getUint16(28,!0)&16383];if(e==="VP8L"){let n=t.getUint32(21,!0);return[(n&16383)+1,(n>>>14&16383)+1]}if(e==="VP8X"){let n=s=>t.getUint16(s,!0)+(r[s+2]<<16);return[n(24)+1,n(27)+1]}}throw new E("a picture of the bundle is neither PNG nor WebP; bake it again")}async function rt(r,t){let o=await r.file(t.file);if(o.length>Rt)throw new E(`${t.file}: too large`);let[e,n]=kt(o);if(e*n>_t||Math.max(e,n)>bt)throw new E(`${t.file}: ${e} x ${n} pixels, more than any bundle has`);if(e%t.columns||n%t.rows)throw new E(`${t.file}: does not divide into its grid; bake it again`);let s=o[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([o],{type:s}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var nt=64,Ft=.12,C=class{constructor(t,o){let e=S(t.photo_camera);this.columns=nt,this.rows=Math.max(8,Math.round(nt*e.height/e.width)),this.pose=t.pose.weights;let n=this.columns*this.rows,{owner:s,places:i}=this.#t(e,o),c=this.#e(s);this.fields=t.expressions.map((a,h)=>this.#s(e,o,h,s,i,c)),this.sum=new Float32Array(2*n)}#t(t,o){let[e,n]=o.ranges.skin,s=0;for(let f=e;f<e+n;f++)s=Math.max(s,o.indices[f]);let i=o.part.length,c=o.reach/32767,a=new Float32Array(3*(s+1)),h=new Int32Array(this.columns*this.rows).fill(-1),l=new Float32Array(h.length).fill(1/0);for(let f=0;f<=s;f++){for(let A=0;A<3;A++){let y=o.positions[3*f+A];for(let v=0;v<this.pose.length;v++)this.pose[v]&&(y+=this.pose[v]*c*o.shapes[4*(v*i+f)+A]);a[3*f+A]=y}let[p,d,m]=L(t,a.subarray(3*f,3*f+3)),u=Math.floor(p/t.width*this.columns),g=Math.floor(d/t.height*this.rows);if(u<0||g<0||u>=this.columns||g>=this.rows)continue;let w=g*this.columns+u;m<l[w]&&([l[w],h[w]]=[m,f])}return{owner:h,places:a}}#e(t){let{columns:o,rows:e}=this,n=Float32Array.from(t,c=>c>=0?0:1e3),s=(c,a,h)=>{n[a]+h<n[c]&&(n[c]=n[a]+h)};for(let c=0;c<2;c++)for(let a=0;a<n.length;a++){let h=c?n.length-1-a:a,l=h%o,f=(h-l)/o,p=c?1:-1;l+p>=0&&l+p<o&&s(h,h+p,1),f+p>=0&&f+p<e&&(s(h,h+p*o,1),l>0&&s(h,h+p*o-1,1.4),l<o-1&&s(h,h+p*o+1,1.4))}let i=Ft*e;return n.map(c=>c===0?1:Math.min(Math.max(c/i-1,0),1))}#s(t,o,e,n,s,i){let c=o.part.length,a=o.reach/32767,h=new Float32Array(2*n.length),l=!1;return n.forEach((f,p)=>{if(f<0)return;let d=4*(e*c+f),m=[0,1,2].map(v=>o.shapes[d+v]*a);if(!m.some(v=>Math.abs(v)>.01))return;let u=Array.from(s.subarray(3*f,3*f+3)),[g,w]=L(t,u),[A,y]=L(t,u.map((v,R)=>v+m[R]));h[2*p]=(g-A)/t.width,h[2*p+1]=(w-y)/t.height,l=!0}),l?it(h,i,this.columns,this.rows):null}at(t){return this.sum.fill(0),this.fields.forEach((o,e)=>{let n=t[e]-this.pose[e];if(!(!o||Math.abs(n)<1e-4))for(let s=0;s<o.length;s++)this.sum[s]+=n*o[s]}),this.sum}};function it(r,t,o,e){if(Math.min(o,e)<2)return r;let[n,s]=[o+1>>1,e+1>>1],i=new Float32Array(2*n*s),c=new Float32Array(n*s);for(let l=0;l<e;l++)for(let f=0;f<o;f++){let p=l*o+f,d=(l>>1)*n+(f>>1);c[d]+=t[p],i[2*d]+=t[p]*r[2*p],i[2*d+1]+=t[p]*r[2*p+1]}for(let l=0;l<c.length;l++){let f=c[l]>0?1/c[l]:0;i[2*l]*=f,i[2*l+1]*=f,c[l]=Math.min(1,c[l])}let a=it(i,c,n,s),h=new Float32Array(r.length);for(let l=0;l<e;l++)for(let f=0;f<o;f++){let p=l*o+f,d=Math.min(Math.max((f-.5)/2,0),n-1),m=Math.min(Math.max((l-.5)/2,0),s-1),[u,g]=[Math.floor(d),Math.floor(m)],[w,A]=[Math.min(u+1,n-1),Math.min(g+1,s-1)];for(let y=0;y<2;y++){let v=a[2*(g*n+u)+y]*(1-d+u)+a[2*(g*n+w)+y]*(d-u),R=a[2*(A*n+u)+y]*(1-d+u)+a[2*(A*n+w)+y]*(d-u),x=v*(1-m+g)+R*(m-g);h[2*p+y]=t[p]*r[2*p+y]+(1-t[p])*x}}return h}var b=class{constructor(t,o,e){this.gl=t,this.handle=t.createProgram();for(let[n,s]of[[t.VERTEX_SHADER,o],[t.FRAGMENT_SHADER,e]]){let i=t.createShader(n);t.shaderSource(i,`#version 300 es
`+s),t.compileShader(i),t.attachShader(this.handle,i),t.deleteShader(i)}t.linkProgram(this.handle),this.places=null}use(){let{gl:t}=this;if(t.useProgram(this.handle),this.places)return;if(!t.getProgramParameter(this.handle,t.LINK_STATUS)&&!t.isContextLost()){let e=t.getAttachedShaders(this.handle).map(n=>t.getShaderInfoLog(n));throw new E(`this browser's graphics refuse a shader: ${e.join(" ").slice(0,300)}`)}this.places=new Map;let o=t.getProgramParameter(this.handle,t.ACTIVE_UNIFORMS);for(let e=0;e<o;e++){let n=t.getActiveUniform(this.handle,e).name.replace("[0]","");this.places.set(n,t.getUniformLocation(this.handle,n))}}at(t){return this.places.get(t)??null}textures(t){let{gl:o}=this,e=0;for(let[n,[s,i]]of Object.entries(t))o.activeTexture(o.TEXTURE0+e),o.bindTexture(s,i),o.uniform1i(this.at(n),e++)}};function U(r,{format:t,width:o,height:e,layers:n=0,linear:s=!1}){let i=n?r.TEXTURE_2D_ARRAY:r.TEXTURE_2D,c=r.createTexture();r.bindTexture(i,c),n?r.texStorage3D(i,1,t,o,e,n):r.texStorage2D(i,1,t,o,e);let a=s?r.LINEAR:r.NEAREST;return r.texParameteri(i,r.TEXTURE_MIN_FILTER,a),r.texParameteri(i,r.TEXTURE_MAG_FILTER,a),r.texParameteri(i,r.TEXTURE_WRAP_S,r.CLAMP_TO_EDGE),r.texParameteri(i,r.TEXTURE_WRAP_T,r.CLAMP_TO_EDGE),c}var F=class{constructor(t,{format:o,width:e,height:n,count:s=1,linear:i=!1,depth:c=!1}){this.gl=t,this.width=e,this.height=n,this.textures=Array.from({length:s},()=>U(t,{format:o,width:e,height:n,linear:i})),this.handle=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.handle);let a=this.textures.map((h,l)=>(t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+l,t.TEXTURE_2D,h,0),t.COLOR_ATTACHMENT0+l));t.drawBuffers(a),this.depth=null,c&&(this.depth=t.createRenderbuffer(),t.bindRenderbuffer(t.RENDERBUFFER,this.depth),t.renderbufferStorage(t.RENDERBUFFER,t.DEPTH_COMPONENT24,e,n),t.framebufferRenderbuffer(t.FRAMEBUFFER,t.DEPTH_ATTACHMENT,t.RENDERBUFFER,this.depth)),this.complete=t.checkFramebufferStatus(t.FRAMEBUFFER)===t.FRAMEBUFFER_COMPLETE,t.bindFramebuffer(t.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:t}=this;this.textures.forEach(o=>t.deleteTexture(o)),this.depth&&t.deleteRenderbuffer(this.depth),t.deleteFramebuffer(this.handle)}};var Ut=[0,2,4,8];function $(r,t,o){let e=r.length-o;if(r[0]!==160||e<1)throw new E("packed vertices of another version");let n=new Uint8Array(t*o),s=r.slice(e),i=Math.min((8192/o|0)&-16,256),c=new Uint8Array(256),a=1;for(let h=0;h<t;h+=i){let l=Math.min(i,t-h),f=l+15>>4;for(let p=0;p<o;p++){let d=a;a+=f+3>>2;for(let u=0;u<f;u++){let g=r[d+(u>>2)]>>((u&3)<<1)&3;a=Mt(r,a,Ut[g],c,u<<4)}if(a>e)throw new E("packed vertices that end too soon");let m=s[p];for(let u=0,g=h*o+p;u<l;u++,g+=o){let w=c[u];m=m+(w>>>1^-(w&1))&255,n[g]=m}s[p]=m}}return n}function Mt(r,t,o,e,n){if(o===0)return e.fill(0,n,n+16),t;if(o===8){for(let a=0;a<16;a++)e[n+a]=r[t+a];return t+16}let s=(1<<o)-1,i=8/o,c=t+16/i;for(let a=0;a<16;a++){let h=8-o-a%i*o,l=r[t+(a/i|0)]>>h&s;e[n+a]=l===s?r[c++]:l}return c}function V(r,t){if(r[0]!==209)throw new E("packed indices of another version");let o=new Uint32Array(t),e=new Uint32Array(2),n=1;for(let s=0;s<t;s++){let i=0,c,a=0;do{if(n>=r.length)throw new E("packed indices that end too soon");c=r[n++],i|=(c&127)<<a,a+=7}while(c>127);let h=i&1,l=i>>>1;o[s]=e[h]+=l>>>1^-(l&1)}return o}var N=["skin","eye_cap_left","eye_cap_right","mouth_sheet","inside","teeth","tongue"],at=65535;function ct(r){let{document:t,binary:o}=Dt(r),e=t.meshes?.[0],n=t.nodes?.[0]?.scale;(!e||!n||e.extras?.targetNames?.length!==T)&&k("lacks its 52 shapes");let s=n[0]*1e3,i=new Map(e.primitives.map(u=>[t.materials[u.material].name,u])),c=N.filter(u=>i.has(u));c[0]!=="skin"&&k("lacks its skin");let a=u=>Lt(t,o,u),h=c.map(u=>t.accessors[i.get(u).attributes.POSITION].count),l=h.reduce((u,g)=>u+g,0);l>at&&k(`has ${l} vertices, more than ${at}`);let f=c.map(u=>t.accessors[i.get(u).indices].count),p={positions:new Float32Array(3*l),normals:new Int8Array(4*l),uv:new Float32Array(2*l),part:new Uint8Array(l),indices:new Uint16Array(f.reduce((u,g)=>u+g,0)),shapes:new Int16Array(T*4*l),reach:s,ranges:{}},d=0,m=0;return c.forEach((u,g)=>{let{attributes:w,indices:A,targets:y}=i.get(u),v=a(w.POSITION);for(let x=0;x<v.length;x++)p.positions[3*d+x]=v[x]*s;p.normals.set(a(w.NORMAL),4*d),p.uv.set(a(w.TEXCOORD_0),2*d),p.part.fill(N.indexOf(u),d,d+h[g]);let R=a(A);for(let x=0;x<R.length;x++)R[x]>=h[g]&&k("has a triangle without a corner"),p.indices[m+x]=R[x]+d;y?.length!==T&&k("lacks its 52 shapes"),y.forEach((x,G)=>p.shapes.set(a(x.POSITION),4*(G*l+d))),p.ranges[u]=[m,R.length],d+=h[g],m+=R.length}),p}function k(r){throw new E(`the bundle's web/head.glb ${r}; bake it again`)}function Dt(r){let t=new DataView(r.buffer,r.byteOffset,r.byteLength);(r.length<20||t.getUint32(0,!0)!==1179937895)&&k("is no GLB file");let o=t.getUint32(12,!0);return 20+o+8>r.length&&k("is cut short"),{document:JSON.parse(new TextDecoder().decode(r.subarray(20,20+o))),binary:r.subarray(28+o)}}var St={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Lt(r,t,o){let e=r.accessors[o],n=r.bufferViews[e.bufferView].extensions.EXT_meshopt_compression,{byteOffset:s=0,byteLength:i,byteStride:c,count:a,mode:h}=n;(a!==e.count||a>4*2**20||c>256)&&k("is damaged"),s+i>t.length&&k("is cut short");let l=t.subarray(s,s+i),f=St[e.componentType];return h==="ATTRIBUTES"?new f($(l,a,c).buffer):f.from(V(l,a))}var O=class{constructor(t,o){this.size=o.rest.length,this.known=new Float64Array(t.length*this.size),this.length=new Float64Array(t.length),t.forEach((e,n)=>{this.known.set(e,n*this.size),this.length[n]=Math.hypot(...e)}),this.rest=Float64Array.from(o.rest),this.shapes=o.shapes.map(e=>Float64Array.from(e)),this.moves=this.shapes.map(e=>e.some(n=>n!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(t.length),this.order=Array.from(t,(e,n)=>n),this.count=Math.min(50,t.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(t){let{wanted:o,known:e,score:n,size:s,order:i}=this;o.set(this.rest);for(let m=0;m<t.length;m++){let u=t[m];if(u===0||!this.moves[m])continue;let g=this.shapes[m];for(let w=0;w<s;w++)o[w]+=u*g[w]}let c=0;for(let m=0;m<s;m++)c+=o[m]*o[m];let a=Math.sqrt(c);for(let m=0,u=0;m<n.length;m++){let g=0;for(let w=0;w<s;w++,u++)g+=e[u]*o[w];n[m]=g/(this.length[m]*a)}i.sort((m,u)=>n[u]-n[m]||m-u);let h=1-n[i[0]],l=Math.max(.25*h,1e-4),f=0,p=!1,d=new Float64Array(this.count);for(let m=0;m<this.count;m++)d[m]=Math.exp((h-(1-n[i[m]]))/l),f+=d[m];for(let m=0;m<this.count;m++){let u=d[m]/f;p||=this.index[m]!==i[m]||Math.abs(this.weight[m]-u)>1e-7,this.index[m]=i[m],this.weight[m]=u}return p}};function ht(r,t){let o=0,e=1/0;return r.forEach(([n,s],i)=>{let c=(n-t[0])**2+(s-t[1])**2;c<e&&([o,e]=[i,c])}),o}var lt=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,M=`
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`,ft=`
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`,ut=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`,mt=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`,pt=`
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`,dt=`
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
out vec2 uv;
out vec3 toward;
out vec3 bent;
out float height;
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 place = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(place, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  toward = mat3(view) * normal.xyz;
  height = position.y;
  gl_Position = projection * (view * vec4(p, 1.0));
}`,gt=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 toward;
in vec3 bent;
in float height;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft;
uniform vec3 light[9];
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
out vec4 color;
${lt}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
float harmonics(vec3 n) {
  vec3 sum = 0.282095 * light[0] + 0.488603 * (n.y * light[1] + n.z * light[2] + n.x * light[3])
    + 1.092548 * (n.x * n.y * light[4] + n.y * n.z * light[5] + n.x * n.z * light[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * light[6] + 0.546274 * (n.x * n.x - n.y * n.y) * light[8];
  return dot(sum, vec3(0.2126, 0.7152, 0.0722));
}
float studio(vec3 n) {
  float key = max(dot(n, normalize(vec3(-0.55, 0.6, 0.65))), 0.0);
  float fill = 0.5 + 0.5 * dot(n, normalize(vec3(0.7, 0.15, 0.5)));
  float rim = pow(1.0 - clamp(n.z, 0.0, 1.0), 3.0) * max(n.y + 0.4, 0.0);
  return 0.85 * key + 0.32 * fill + 0.5 * rim + 0.1;
}
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    c = four(mouth, ivec2(0), textureSize(mouth, 0), (uv - places[2].xy) / places[2].zw);
  } else if (part == 1u || part == 2u) {
    vec4 box = places[int(part) - 1];
    c = four(gaze, eyeCorner + ivec2(int(part) - 1, 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 0u) known = texture(coverage, uv).r;
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 0u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 0u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    vec3 n = normalize(bent);
    float was = harmonics(n) / max(harmonics(vec3(0.0, 0.0, 1.0)), 0.05);
    float now = studio(normalize(toward)) / studio(vec3(0.0, 0.0, 1.0));
    float ratio = clamp(now / max(was, 0.35), 0.15, 2.2);
    c *= part == 0u ? ratio : mix(1.0, ratio, 0.5);
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha = smoothstep(fade.x, fade.y, height);
  }
  color = vec4(toEncoded(c), alpha);
}`,wt=`
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${lt}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var B=256;async function j(r){let{atlases:t,keys:o}=r.description,n=["neutral",...o.map(i=>i.name),"gaze","mouths","masks","coverage","hair","photo"].filter(i=>Object.hasOwn(t,i)),s=await Promise.all(n.map(i=>rt(r,t[i])));return Object.fromEntries(n.map((i,c)=>[i,s[c]]))}var z=class{constructor(t,o,e,n){this.gl=t;let s=t.getParameter(t.MAX_TEXTURE_SIZE);for(let[i,c]of Object.entries(e))if(Math.max(c.width,c.height)>s)throw new E(`${i}: ${c.width} x ${c.height} texels, this device takes ${s}; bake with --preset mobile`);t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.pixelStorei(t.UNPACK_FLIP_Y_WEBGL,!1),this.side=e.neutral.width,this.faces=this.#t(["neutral",...o.keys.map(i=>i.name)].map(i=>e[i])),this.mouths=this.#e(e.mouths,t.RGBA8),this.gaze=this.#e(e.gaze,t.RGBA8),this.coverage=this.#e(e.coverage??Y(255),t.RGBA8,!0),this.hairy=!!e.hair,this.hair=this.#e(e.hair??Y(0),t.SRGB8_ALPHA8),this.photo=this.#e(e.photo??Y(0),t.SRGB8_ALPHA8,!0,!!e.photo),this.masks=this.#s(e.masks,o.atlases.masks),this.#r(n)}#t(t){let{gl:o,side:e}=this,n=U(o,{format:o.SRGB8_ALPHA8,width:e,height:e,layers:t.length});return t.forEach((s,i)=>{if(s.width!==e||s.height!==e)throw new E("face pictures differ in size; bake the bundle again");o.texSubImage3D(o.TEXTURE_2D_ARRAY,0,0,0,i,e,e,1,o.RGBA,o.UNSIGNED_BYTE,s)}),n}#e(t,o,e=!1,n=!1){let{gl:s}=this,i=s.createTexture();s.bindTexture(s.TEXTURE_2D,i);let{width:c,height:a}=t,h=n?Math.floor(Math.log2(Math.max(c,a)))+1:1;s.texStorage2D(s.TEXTURE_2D,h,o,c,a),t.data?s.texSubImage2D(s.TEXTURE_2D,0,0,0,c,a,s.RGBA,s.UNSIGNED_BYTE,t.data):s.texSubImage2D(s.TEXTURE_2D,0,0,0,s.RGBA,s.UNSIGNED_BYTE,t),n&&s.generateMipmap(s.TEXTURE_2D);let l=e?s.LINEAR:s.NEAREST;return s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,n?s.LINEAR_MIPMAP_LINEAR:l),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MAG_FILTER,l),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),i}#s(t,o){let{gl:e}=this,n=t.width/o.columns,s=Math.ceil(T/4),i=this.#e(t,e.RGBA8),c=U(e,{format:e.RGBA8,width:n,height:n,layers:s,linear:!0}),a=new b(e,M,ft),h=e.createFramebuffer();e.bindFramebuffer(e.FRAMEBUFFER,h),e.viewport(0,0,n,n),e.disable(e.DEPTH_TEST),e.disable(e.BLEND),e.disable(e.CULL_FACE),a.use(),a.textures({atlas:[e.TEXTURE_2D,i]}),e.uniform1i(a.at("columns"),o.columns),e.uniform1i(a.at("count"),T),e.uniform1i(a.at("side"),n);for(let l=0;l<s;l++)e.framebufferTextureLayer(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0,c,0,l),e.uniform1i(a.at("first"),4*l),e.drawArrays(e.TRIANGLES,0,3);return e.bindFramebuffer(e.FRAMEBUFFER,null),e.deleteFramebuffer(h),e.deleteTexture(i),e.deleteProgram(a.handle),this.maskSide=n,c}#r(t){let{gl:o}=this,e=t.part.length;this.array=o.createVertexArray(),o.bindVertexArray(this.array);let n=(a,h,l,f,p)=>{o.bindBuffer(o.ARRAY_BUFFER,o.createBuffer()),o.bufferData(o.ARRAY_BUFFER,h,o.STATIC_DRAW),o.enableVertexAttribArray(a),f===o.UNSIGNED_BYTE?o.vertexAttribIPointer(a,l,f,0,0):o.vertexAttribPointer(a,l,f,p,0,0)};n(0,t.positions,3,o.FLOAT,!1),n(1,t.normals,4,o.BYTE,!0),n(2,t.uv,2,o.FLOAT,!1),n(3,t.part,1,o.UNSIGNED_BYTE,!1),o.bindBuffer(o.ELEMENT_ARRAY_BUFFER,o.createBuffer()),o.bufferData(o.ELEMENT_ARRAY_BUFFER,t.indices,o.STATIC_DRAW),o.bindVertexArray(null);let s=Math.ceil(e/B);this.shapes=U(o,{format:o.RGBA16I,width:B,height:s,layers:T});let i=new Int16Array(4*B*s);for(let a=0;a<T;a++)i.set(t.shapes.subarray(4*a*e,4*(a+1)*e)),o.texSubImage3D(o.TEXTURE_2D_ARRAY,0,0,0,a,B,s,1,o.RGBA_INTEGER,o.SHORT,i);this.step=t.reach/32767;let c=a=>a.filter(h=>t.ranges[h]).map(h=>t.ranges[h]);this.runs={image:Et(c(N.slice(0,4))),geometry:Et(c(N.filter(a=>a!=="mouth_sheet")))}}};function Et(r){let t=[];for(let[o,e]of r){let n=t.at(-1);n&&n[0]+n[1]===o?n[1]+=e:t.push([o,e])}return t}var Y=r=>({width:1,height:1,data:new Uint8Array(4).fill(r)});function xt(r,t,o,e){let n=r.getExtension("EXT_color_buffer_float")||r.getExtension("EXT_color_buffer_half_float"),s=h=>new F(r,{format:h,width:t,height:t,linear:!0}),i=h=>new F(r,{format:h,width:o,height:o,count:2,linear:!0}),c=n&&{face:s(r.RGBA16F),weights:i(r.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:s(r.SRGB8_ALPHA8),weights:i(r.RGBA8)});let a=new F(r,{format:r.RGBA8,width:e[0],height:e[1]});return{...c,mouth:a}}var Pt=["color","mask","coverage","uv"],Nt=[0,-75,-45],It=46,le=[32,24];async function fe(r,{canvas:t,antialias:o=!0}){let e=t.getContext("webgl2",{antialias:o,alpha:!1,powerPreference:"high-performance"});if(!e)throw new E("this browser has no WebGL 2; update it, or turn hardware acceleration on");let n=typeof r=="string"?await et(r):r;ot(n.description);let s=yt(e),[i,c]=await Promise.all([j(n),n.file("head.glb")]);return new W(e,n,i,ct(c),s)}function yt(r){return{weights:new b(r,M,ut),compose:new b(r,M,mt),median:new b(r,M,pt),backdrop:new b(r,M,wt),head:new b(r,dt,gt)}}var W=class{#t;#e;#s;#r;#n;#o;#u=null;#i=null;#m=!1;#a=!0;#c=!0;#w="";#h=new Float32Array(416);#l=new Float32Array(100);#p=new Float32Array(104);constructor(t,o,e,n,s){this.#t=t,this.#e=o,this.#s=n,this.#r=s;let i=o.description;this.about=i,this.expressions=i.expressions,this.canvas=t.canvas,this.weights=new Float32Array(i.expressions.length),this.index=new Map(i.expressions.map((a,h)=>[a,h])),this.hasPhoto=!!i.atlases.photo,this.hasHair=!!i.atlases.hair,this.options={stage:"studio",dynamic:!0,hair:!0,mouth:"image",light:!1,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new O(i.mouths,i.lips),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0};let c=n.positions.reduce((a,h,l)=>l%3===1?Math.min(a,h):a,0);this.bottom=c,this.#E(e),Object.values(e).forEach(a=>a.close()),this.canvas.addEventListener("webglcontextlost",a=>{a.preventDefault(),this.#m=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#v())}#E(t){let o=this.#t,{about:e}=this;this.#n=new z(o,e,t,this.#s);let n=s=>{let{columns:i,rows:c}=e.atlases[s];return[t[s].width/i,t[s].height/c]};this.mouthCell=n("mouths"),this.gazeCell=n("gaze"),this.photoSize=t.photo?[t.photo.width,t.photo.height]:null,this.#o=xt(o,this.#n.side,this.#n.maskSide,this.mouthCell),this.#i=null,this.#a=this.#c=!0,this.mouths.weight.fill(-1)}async#v(){this.#r=yt(this.#t);let t=await j(this.#e);this.#E(t),Object.values(t).forEach(o=>o.close()),this.#m=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(t){for(let[o,e]of Object.entries(t)){let n=this.index.get(o);if(n===void 0)throw new E(`no expression '${String(o).slice(0,40)}'`);if(!Number.isFinite(e))throw new E(`${o}: ${e} is no weight`);let s=Math.fround(Math.min(Math.max(e,0),1));this.weights[n]!==s&&(this.weights[n]=s,o.startsWith("eyeLook")&&(this.direction=null),this.#a=this.#c=!0)}return this}get(t){return this.weights[this.index.get(t)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#a=this.#c=!0,this}look(t,o){if(!Number.isFinite(t+o))throw new E("gaze is no number");let[e,n]=this.about.eyes.degrees;for(let[s,i]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+s]:Number(i)*t/e,["eyeLookIn"+s]:-Number(i)*t/e,["eyeLookUp"+s]:o/n,["eyeLookDown"+s]:-o/n});return this.direction=[t,o],this}get gaze(){if(this.direction)return this.direction;let[t,o]=this.about.eyes.degrees,e=i=>this.get(i),n=e("eyeLookOutLeft")-e("eyeLookInLeft")-e("eyeLookOutRight")+e("eyeLookInRight"),s=e("eyeLookUpLeft")-e("eyeLookDownLeft")+e("eyeLookUpRight")-e("eyeLookDownRight");return[t*n/2,o*s/2]}turn(t,o,e=0){if(!Number.isFinite(t+o+e))throw new E("a head turn is no number");return this.head=[t,o,e],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(t=this.canvas.width,o=this.canvas.height){let{about:e,orbit:n}=this,s=n.shift.map(l=>l*o);if(this.inPhoto){let{width:l,height:f}=e.photo_camera,p=Math.min(t/l,o/f)*n.zoom;return I(S(e.photo_camera),[l/2,f/2],p,t,o,s)}let i=S(e.front_camera),c=.74*Math.min(t*1.12,o)*n.zoom/i.width,a=[i.width/2,i.height*.5],h=K(I(i,a,c,t,o,s),n.yaw,n.pitch,e.pivot);return this.head.some(Boolean)?Z(h,H(...this.head),Nt):h}frontView(t){let o=S(this.about.front_camera);return I(o,[o.width/2,o.height/2],t/o.width,t,t)}eyes(){let t=this.view();return this.about.eyes.centers.map(([o,e,n])=>{let[s,i,c]=L(t,[o,e,n+11]);return[s,i,13*t.focal/c]})}render(){if(this.#m)return;let t=performance.now();this.#d(),this.#g();let o=this.#t;o.bindFramebuffer(o.FRAMEBUFFER,null),o.viewport(0,0,this.canvas.width,this.canvas.height),this.#x(this.view(),!1),this.stats.milliseconds=performance.now()-t}capture({width:t,height:o,view:e=this.view(t,o)}){let n=this.#t;this.#d(),this.#g();let s=new F(n,{format:n.RGBA8,width:t,height:o,depth:!0});s.bind(),this.#x(e,!0);let i=vt(n,t,o);return s.dispose(),Ct(i,t,o)}mouthSheet(){this.#d(),this.#g();let{mouth:t}=this.#o;return t.bind(),{width:t.width,height:t.height,data:vt(this.#t,t.width,t.height)}}#d(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0})}#g(){let t=this.#t,{dynamic:o,hair:e}=this.options,n=`${o} ${e}`;(this.#a||n!==this.#w)&&(t.disable(t.DEPTH_TEST),t.disable(t.BLEND),t.disable(t.CULL_FACE),this.#y(o,e&&this.#n.hairy),this.mouths.find(this.weights)&&this.#A(),this.#a=!1,this.#w=n),this.inPhoto&&(this.#c||!this.#i)&&this.#T()}#y(t,o){let e=this.#t,{weights:n,compose:s}=this.#r,i=this.#n,{keys:c}=this.about,a=[];this.#h.fill(0);for(let f=0;f<this.weights.length;f++){let p=t?this.weights[f]:0;if(p===0||!c.some(m=>m.weights[f]))continue;let d=f>>2;a.at(-1)!==d&&a.push(d),c.forEach((m,u)=>{this.#h[4*(8*d+u)+(f&3)]=m.weights[f]*p})}this.#o.weights.bind(),n.use(),n.textures({masks:[e.TEXTURE_2D_ARRAY,i.masks]}),e.uniform1i(n.at("groups"),a.length),a.length&&e.uniform1iv(n.at("group"),a),e.uniform4fv(n.at("product"),this.#h),this.#f(4+4*a.length+this.#h.byteLength),this.#o.face.bind(),s.use();let[h,l]=this.#o.weights.textures;s.textures({faces:[e.TEXTURE_2D_ARRAY,i.faces],low:[e.TEXTURE_2D,h],high:[e.TEXTURE_2D,l],hair:[e.TEXTURE_2D,i.hair]}),e.uniform1i(s.at("keys"),a.length?c.length:0),e.uniform1i(s.at("hairy"),Number(o)),this.#f(8),this.stats.compositions++}#A(){let t=this.#t,o=this.#r.median,{mouths:e}=this;for(let n=0;n<e.count;n++)this.#l[2*n]=e.index[n],this.#l[2*n+1]=e.weight[n];this.#o.mouth.bind(),o.use(),o.textures({mouths:[t.TEXTURE_2D,this.#n.mouths]}),t.uniform1i(o.at("columns"),this.about.atlases.mouths.columns),t.uniform1i(o.at("count"),e.count),t.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),t.uniform2fv(o.at("neighbour"),this.#l),this.#f(16+this.#l.byteLength),this.stats.medians++}#T(){let t=this.#t;this.#u??=new C(this.about,this.#s);let{columns:o,rows:e}=this.#u;this.#i??=U(t,{format:t.RG16F,width:o,height:e,linear:!0}),t.bindTexture(t.TEXTURE_2D,this.#i);let n=this.#u.at(this.weights);t.texSubImage2D(t.TEXTURE_2D,0,0,0,o,e,t.RG,t.FLOAT,n),this.#c=!1}#f(t){this.#t.drawArrays(this.#t.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=t}#x(t,o){let e=this.#t,{options:n,about:s}=this,i=this.#n,{backdrop:c,head:a}=this.#r,{inPhoto:h}=this;e.disable(e.BLEND),e.disable(e.CULL_FACE),e.disable(e.DEPTH_TEST);let l=t.focal/s.photo_camera.focal,f=[t.center[0]-s.photo_camera.center[0]*l,t.center[1]-s.photo_camera.center[1]*l,s.photo_camera.width*l,s.photo_camera.height*l],p=h?this.#i:i.hair;c.use(),c.textures({photo:[e.TEXTURE_2D,i.photo],flow:[e.TEXTURE_2D,p]}),e.uniform4fv(c.at("frame"),f),e.uniform2f(c.at("size"),t.width,t.height),e.uniform1i(c.at("inPhoto"),Number(h)),e.uniform1i(c.at("plain"),Number(o&&!h)),e.uniform3fv(c.at("wall"),n.wall),e.uniform3fv(c.at("floorTint"),n.floor),this.#f(56),e.enable(e.DEPTH_TEST),e.clear(e.DEPTH_BUFFER_BIT),e.enable(e.CULL_FACE),o||(e.enable(e.BLEND),e.blendFunc(e.SRC_ALPHA,e.ONE_MINUS_SRC_ALPHA)),a.use(),a.textures({face:[e.TEXTURE_2D,this.#o.face.textures[0]],mouth:[e.TEXTURE_2D,this.#o.mouth.textures[0]],gaze:[e.TEXTURE_2D,i.gaze],coverage:[e.TEXTURE_2D,i.coverage],photo:[e.TEXTURE_2D,i.photo],flow:[e.TEXTURE_2D,p],masks:[e.TEXTURE_2D_ARRAY,i.masks],shapes:[e.TEXTURE_2D_ARRAY,i.shapes]});let d=0;for(let x=0;x<this.weights.length;x++)this.weights[x]!==0&&(this.#p[2*d]=x,this.#p[2*d+++1]=this.weights[x]*i.step);let{gaze:m}=this,u=ht(s.gaze,m),g=2*s.eyes.cap,{columns:w}=s.atlases.gaze,[A,y]=this.gazeCell;e.uniformMatrix4fv(a.at("view"),!1,q(t)),e.uniformMatrix4fv(a.at("projection"),!1,J(t)),e.uniform1i(a.at("count"),d),d&&e.uniform2fv(a.at("moving"),this.#p.subarray(0,2*d));let{uv:v}=s;e.uniform4fv(a.at("places"),[...v.eye_cap_left,...v.eye_cap_right,...v.mouth_sheet]),e.uniform2i(a.at("eyeCell"),A/2,y),e.uniform2i(a.at("eyeCorner"),u%w*A,Math.floor(u/w)*y),e.uniform2f(a.at("slide"),(m[0]-s.gaze[u][0])/g,(s.gaze[u][1]-m[1])/g),e.uniform1i(a.at("layer"),Pt.indexOf(n.layer)),e.uniform1i(a.at("shown"),this.index.get(n.layerExpression)),e.uniform1i(a.at("lit"),Number(n.light&&!h&&!o)),e.uniform1i(a.at("inPhoto"),Number(h)),e.uniform1i(a.at("soft"),+(!o&&!h)),e.uniform3fv(a.at("light"),s.light.flat()),e.uniform2f(a.at("fade"),this.bottom+2,this.bottom+It),e.uniform4fv(a.at("frame"),f),e.uniform1f(a.at("tall"),t.height),this.stats.uniformBytes+=128+8*d+48+24+24+108+8+20,e.bindVertexArray(i.array);let R=n.mouth==="geometry"?i.runs.geometry:i.runs.image;for(let[x,G]of R)e.drawElements(e.TRIANGLES,G,e.UNSIGNED_SHORT,2*x),this.stats.drawCalls++;e.bindVertexArray(null)}dispose(){this.#t.getExtension("WEBGL_lose_context")?.loseContext()}};function vt(r,t,o){let e=new Uint8Array(4*t*o);return r.pixelStorei(r.PACK_ALIGNMENT,1),r.readPixels(0,0,t,o,r.RGBA,r.UNSIGNED_BYTE,e),r.bindFramebuffer(r.FRAMEBUFFER,null),e}function Ct(r,t,o){let e=new Uint8Array(r.length);for(let n=0;n<o;n++)e.set(r.subarray(4*t*n,4*t*(n+1)),4*t*(o-1-n));return e}export{W as Avatar,E as AvatarError,le as MOST_GAZE,V as decodeIndices,$ as decodeVertices,fe as load,ct as parseHead};
