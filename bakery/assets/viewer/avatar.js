var M=Math.PI/180;function At([n,t,o]){let e=Math.hypot(n,t,o);if(e<1e-12)return[1,0,0,0,1,0,0,0,1];[n,t,o]=[n/e,t/e,o/e];let r=Math.cos(e),s=Math.sin(e),i=1-r;return[r+n*n*i,n*t*i-o*s,n*o*i+t*s,t*n*i+o*s,r+t*t*i,t*o*i-n*s,o*n*i-t*s,o*t*i+n*s,r+o*o*i]}function X(n,t,o=0){let[e,r]=[Math.cos(n*M),Math.sin(n*M)],[s,i]=[Math.cos(t*M),Math.sin(t*M)],[c,a]=[Math.cos(-o*M),Math.sin(-o*M)],l=G([e,0,r,0,1,0,-r,0,e],[1,0,0,0,s,-i,0,i,s]);return G(l,[c,-a,0,a,c,0,0,0,1])}function G(n,t){let o=new Array(9);for(let e=0;e<3;e++)for(let r=0;r<3;r++)o[3*e+r]=n[3*e]*t[r]+n[3*e+1]*t[3+r]+n[3*e+2]*t[6+r];return o}var P=(n,[t,o,e])=>[n[0]*t+n[1]*o+n[2]*e,n[3]*t+n[4]*o+n[5]*e,n[6]*t+n[7]*o+n[8]*e];function S(n){let{focal:t,center:o,translation:e,width:r,height:s}=n;return{rotation:At(n.rotation),translation:e,focal:t,center:o,width:r,height:s}}function W(n,t,o,e){let s=P(n.rotation,e).map((a,l)=>a+n.translation[l]),i=X(t,o),c=P(i,e);return{...n,rotation:i,translation:s.map((a,l)=>a-c[l])}}function N(n,t,o,e,r,s=[0,0]){return{...n,focal:n.focal*o,center:[(n.center[0]-t[0])*o+e/2+s[0],(n.center[1]-t[1])*o+r/2+s[1]],width:e,height:r}}function K(n,t,o){let e=P(t,o),r=P(n.rotation,o.map((s,i)=>s-e[i]));return{...n,rotation:G(n.rotation,t),translation:n.translation.map((s,i)=>s+r[i])}}function Z(n,t){let[o,e,r]=P(n.rotation,t).map((i,c)=>i+n.translation[c]),s=n.focal/-r;return[n.center[0]+o*s,n.center[1]-e*s,-r]}function q({rotation:n,translation:t}){return new Float32Array([n[0],n[3],n[6],0,n[1],n[4],n[7],0,n[2],n[5],n[8],0,t[0],t[1],t[2],1])}function J({focal:n,center:t,width:o,height:e,translation:r}){let s=-r[2],i=Math.max(s-450,s*.05,1),c=s+550;return new Float32Array([2*n/o,0,0,0,0,2*n/e,0,0,1-2*t[0]/o,2*t[1]/e-1,-(c+i)/(c-i),-1,0,0,-2*c*i/(c-i),0])}var E=class extends Error{},Tt=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,_t=64*2**20,bt=256*2**20,Rt=16384,y=52,Q=8;async function et(n){let t=new URL(n.endsWith("/")?n:n+"/",document.baseURI),o=async s=>{let i=await fetch(new URL(s,t));if(!i.ok)throw new E(`${s}: ${i.status} ${i.statusText}`);return new Uint8Array(await i.arrayBuffer())},e=s=>JSON.parse(new TextDecoder().decode(s)),r=e(await o("avatar.json"));return Array.isArray(r.files)?{description:e(await o("web/avatar.json")),file:s=>o("web/"+s)}:{description:r,file:o}}function ot(n){let t=(s,i)=>{if(!s)throw new E(`the bundle's web/avatar.json: ${i}; bake it again`)};t(n&&n.$schema==="urn:bakery:schema:web-1","of another version"),t(st(n),"holds a number that is none");let o=n.expressions;t(Array.isArray(o)&&o.length===y,"lacks the 52 expressions"),t(o.every(s=>/^[A-Za-z]{1,40}$/.test(s)),"has an odd expression"),t(n.keys?.length>=1&&n.keys.length<=Q,`needs 1 to ${Q} keys`),t(n.keys.every(s=>A(s.weights,y)),"keys lack weights"),t(A(n.lips?.rest,80)&&n.lips.shapes?.length===y,"lacks the lips"),t(n.lips.shapes.every(s=>A(s,80)),"lacks the lips"),t(n.mouths?.length>=1&&n.mouths.length<=300,"needs 1 to 300 mouths"),t(n.mouths.every(s=>A(s,80)),"mouths lack landmarks"),t(n.gaze?.length>=1&&n.gaze.every(s=>A(s,2)),"lacks gaze"),t(A(n.pose?.weights,y),"lacks the pose of the photo"),t(A(n.pivot,3)&&n.light?.length===9,"lacks its frame"),t(n.eyes?.cap>0&&A(n.eyes.degrees,2),"lacks eyes"),t(n.eyes.centers?.length===2&&n.eyes.centers.every(s=>A(s,3)),"lacks eyes");for(let s of["photo_camera","front_camera"]){let i=n[s];t(i&&i.focal>0&&A(i.center,2),`lacks ${s}`),t(A(i.rotation,3)&&A(i.translation,3),`lacks ${s}`),t(i.width>0&&i.height>0,`lacks ${s}`)}for(let s of["mouth_sheet","eye_cap_left","eye_cap_right"])t(A(n.uv?.[s],4),`lacks the place of ${s}`);let e=["neutral",...n.keys.map(s=>s.name),"gaze","mouths","masks","coverage"];for(let s of e)t(Object.hasOwn(n.atlases??{},s),"lacks a picture");for(let s of Object.values(n.atlases))t(Tt.test(s.file??""),"names a file outside of its folder"),t(tt(s.columns)&&tt(s.rows),"has an odd grid"),t(s.names?.length<=s.columns*s.rows,"has an odd grid");let r=(s,i)=>t(n.atlases[s].names.length===i,`${s} differ in number`);r("gaze",n.gaze.length),r("mouths",n.mouths.length),r("masks",y)}var A=(n,t)=>Array.isArray(n)&&n.length===t&&n.every(o=>typeof o=="number"),tt=n=>Number.isInteger(n)&&n>=1&&n<=1024;function st(n){return typeof n=="number"?Number.isFinite(n):n&&typeof n=="object"?Object.values(n).every(st):!0}function Ft(n){let t=new DataView(n.buffer,n.byteOffset,n.byteLength),o=e=>String.fromCharCode(...n.subarray(e,e+4));if(n.length>24&&t.getUint32(0)===2303741511)return[t.getUint32(16),t.getUint32(20)];if(n.length>30&&o(0)==="RIFF"&&o(8)==="WEBP"){let e=o(12);if(e==="VP8 ")return[t.getUint16(26,!0)&16383,t.getUint16(28,!0)&16383];if(e==="VP8L"){let r=t.getUint32(21,!0);return[(r&16383)+1,(r>>>14&16383)+1]}if(e==="VP8X"){let r=s=>t.getUint16(s,!0)+(n[s+2]<<16);return[r(24)+1,r(27)+1]}}throw new E("a picture of the bundle is neither PNG nor WebP; bake it again")}async function rt(n,t){let o=await n.file(t.file);if(o.length>bt)throw new E(`${t.file}: too large`);let[e,r]=Ft(o);if(e*r>_t||Math.max(e,r)>Rt)throw new E(`${t.file}: ${e} x ${r} pixels, more than any bundle has`);if(e%t.columns||r%t.rows)throw new E(`${t.file}: does not divide into its grid; bake it again`);let s=o[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([o],{type:s}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var nt=64,kt=.12,I=class{constructor(t,o){this.view=S(t.photo_camera),this.columns=nt,this.rows=Math.max(8,Math.round(nt*this.view.height/this.view.width)),this.step=o.reach/32767;let e=t.pose.weights,r=this.#t(o,e);this.mass=this.#o(r),this.cells=Int32Array.from(r.keys()).filter(c=>r[c]>=0);let s=this.cells.length,i=o.part.length;this.rest=new Float32Array(3*s),this.shapes=e.map(()=>new Int16Array(3*s)),this.cells.forEach((c,a)=>{let l=r[c];for(let h=0;h<3;h++)this.rest[3*a+h]=o.positions[3*l+h],this.shapes.forEach((m,p)=>{m[3*a+h]=o.shapes[4*(p*i+l)+h]})}),this.place=new Float32Array(3*s),this.values=new Float32Array(2*r.length),this.before=new Float32Array(2*s),this.#s(e,this.before)}#t(t,o){let{columns:e,rows:r}=this,[s,i]=t.ranges.skin,c=t.part.length,a=[...new Set(t.indices.subarray(s,s+i))],l=Float32Array.from({length:3*a.length},(f,u)=>t.positions[3*a[Math.floor(u/3)]+u%3]);o.forEach((f,u)=>{if(f)for(let g=0;g<a.length;g++){let w=4*(u*c+a[g]);for(let T=0;T<3;T++)l[3*g+T]+=f*this.step*t.shapes[w+T]}});let h=new Float32Array(2*a.length),m=this.#e(l,h),p=new Int32Array(e*r).fill(-1),d=new Float32Array(p.length).fill(1/0);for(let f=0;f<a.length;f++){let u=Math.floor(h[2*f]*e),g=Math.floor(h[2*f+1]*r);if(u<0||g<0||u>=e||g>=r)continue;let w=g*e+u;m[f]<d[w]&&([d[w],p[w]]=[m[f],a[f]])}return p}#e(t,o){let{rotation:e,translation:r,focal:s,center:i,width:c,height:a}=this.view,l=t.length/3,h=new Float32Array(l);for(let m=0;m<l;m++){let[p,d,f]=[t[3*m],t[3*m+1],t[3*m+2]];h[m]=-(e[6]*p+e[7]*d+e[8]*f+r[2]);let u=s/h[m];o[2*m]=(i[0]+(e[0]*p+e[1]*d+e[2]*f+r[0])*u)/c,o[2*m+1]=(i[1]-(e[3]*p+e[4]*d+e[5]*f+r[1])*u)/a}return h}#s(t,o){this.place.set(this.rest),this.shapes.forEach((e,r)=>{let s=t[r]*this.step;if(s!==0)for(let i=0;i<e.length;i++)this.place[i]+=s*e[i]}),this.#e(this.place,o)}#o(t){let{columns:o,rows:e}=this,r=Float32Array.from(t,c=>c>=0?0:1e3),s=(c,a,l)=>{r[a]+l<r[c]&&(r[c]=r[a]+l)};for(let c=0;c<2;c++)for(let a=0;a<r.length;a++){let l=c?r.length-1-a:a,h=l%o,m=(l-h)/o,p=c?1:-1;h+p>=0&&h+p<o&&s(l,l+p,1),m+p>=0&&m+p<e&&(s(l,l+p*o,1),h>0&&s(l,l+p*o-1,1.4),h<o-1&&s(l,l+p*o+1,1.4))}let i=kt*e;return r.map(c=>c===0?1:Math.min(Math.max(c/i-1,0),1))}at(t){let{cells:o,values:e,before:r}=this,s=new Float32Array(r.length);this.#s(t,s);for(let i=0;i<o.length;i++)e[2*o[i]]=r[2*i]-s[2*i],e[2*o[i]+1]=r[2*i+1]-s[2*i+1];return it(e,this.mass,this.columns,this.rows)}};function it(n,t,o,e){if(Math.min(o,e)<2)return n;let[r,s]=[o+1>>1,e+1>>1],i=new Float32Array(2*r*s),c=new Float32Array(r*s);for(let h=0;h<e;h++)for(let m=0;m<o;m++){let p=h*o+m,d=(h>>1)*r+(m>>1);c[d]+=t[p],i[2*d]+=t[p]*n[2*p],i[2*d+1]+=t[p]*n[2*p+1]}for(let h=0;h<c.length;h++){let m=c[h]>0?1/c[h]:0;i[2*h]*=m,i[2*h+1]*=m,c[h]=Math.min(1,c[h])}let a=it(i,c,r,s),l=new Float32Array(n.length);for(let h=0;h<e;h++)for(let m=0;m<o;m++){let p=h*o+m,d=Math.min(Math.max((m-.5)/2,0),r-1),f=Math.min(Math.max((h-.5)/2,0),s-1),[u,g]=[Math.floor(d),Math.floor(f)],[w,T]=[Math.min(u+1,r-1),Math.min(g+1,s-1)];for(let v=0;v<2;v++){let F=a[2*(g*r+u)+v]*(1-d+u)+a[2*(g*r+w)+v]*(d-u),b=a[2*(T*r+u)+v]*(1-d+u)+a[2*(T*r+w)+v]*(d-u),x=F*(1-f+g)+b*(f-g);l[2*p+v]=t[p]*n[2*p+v]+(1-t[p])*x}}return l}var _=class{constructor(t,o,e){this.gl=t,this.handle=t.createProgram();for(let[r,s]of[[t.VERTEX_SHADER,o],[t.FRAGMENT_SHADER,e]]){let i=t.createShader(r);t.shaderSource(i,`#version 300 es
`+s),t.compileShader(i),t.attachShader(this.handle,i),t.deleteShader(i)}t.linkProgram(this.handle),this.places=null}use(){let{gl:t}=this;if(t.useProgram(this.handle),this.places)return;if(!t.getProgramParameter(this.handle,t.LINK_STATUS)&&!t.isContextLost()){let e=t.getAttachedShaders(this.handle).map(r=>t.getShaderInfoLog(r));throw new E(`this browser's graphics refuse a shader: ${e.join(" ").slice(0,300)}`)}this.places=new Map;let o=t.getProgramParameter(this.handle,t.ACTIVE_UNIFORMS);for(let e=0;e<o;e++){let r=t.getActiveUniform(this.handle,e).name.replace("[0]","");this.places.set(r,t.getUniformLocation(this.handle,r))}}at(t){return this.places.get(t)??null}textures(t){let{gl:o}=this,e=0;for(let[r,[s,i]]of Object.entries(t))o.activeTexture(o.TEXTURE0+e),o.bindTexture(s,i),o.uniform1i(this.at(r),e++)}};function U(n,{format:t,width:o,height:e,layers:r=0,linear:s=!1}){let i=r?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D,c=n.createTexture();n.bindTexture(i,c),r?n.texStorage3D(i,1,t,o,e,r):n.texStorage2D(i,1,t,o,e);let a=s?n.LINEAR:n.NEAREST;return n.texParameteri(i,n.TEXTURE_MIN_FILTER,a),n.texParameteri(i,n.TEXTURE_MAG_FILTER,a),n.texParameteri(i,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(i,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE),c}var k=class{constructor(t,{format:o,width:e,height:r,count:s=1,linear:i=!1,depth:c=!1}){this.gl=t,this.width=e,this.height=r,this.textures=Array.from({length:s},()=>U(t,{format:o,width:e,height:r,linear:i})),this.handle=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.handle);let a=this.textures.map((l,h)=>(t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+h,t.TEXTURE_2D,l,0),t.COLOR_ATTACHMENT0+h));t.drawBuffers(a),this.depth=null,c&&(this.depth=t.createRenderbuffer(),t.bindRenderbuffer(t.RENDERBUFFER,this.depth),t.renderbufferStorage(t.RENDERBUFFER,t.DEPTH_COMPONENT24,e,r),t.framebufferRenderbuffer(t.FRAMEBUFFER,t.DEPTH_ATTACHMENT,t.RENDERBUFFER,this.depth)),this.complete=t.checkFramebufferStatus(t.FRAMEBUFFER)===t.FRAMEBUFFER_COMPLETE,t.bindFramebuffer(t.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:t}=this;this.textures.forEach(o=>t.deleteTexture(o)),this.depth&&t.deleteRenderbuffer(this.depth),t.deleteFramebuffer(this.handle)}};var Ut=[0,2,4,8];function H(n,t,o){let e=n.length-o;if(n[0]!==160||e<1)throw new E("packed vertices of another version");let r=new Uint8Array(t*o),s=n.slice(e),i=Math.min((8192/o|0)&-16,256),c=new Uint8Array(256),a=1;for(let l=0;l<t;l+=i){let h=Math.min(i,t-l),m=h+15>>4;for(let p=0;p<o;p++){let d=a;a+=m+3>>2;for(let u=0;u<m;u++){let g=n[d+(u>>2)]>>((u&3)<<1)&3;a=Dt(n,a,Ut[g],c,u<<4)}if(a>e)throw new E("packed vertices that end too soon");let f=s[p];for(let u=0,g=l*o+p;u<h;u++,g+=o){let w=c[u];f=f+(w>>>1^-(w&1))&255,r[g]=f}s[p]=f}}return r}function Dt(n,t,o,e,r){if(o===0)return e.fill(0,r,r+16),t;if(o===8){for(let a=0;a<16;a++)e[r+a]=n[t+a];return t+16}let s=(1<<o)-1,i=8/o,c=t+16/i;for(let a=0;a<16;a++){let l=8-o-a%i*o,h=n[t+(a/i|0)]>>l&s;e[r+a]=h===s?n[c++]:h}return c}function $(n,t){if(n[0]!==209)throw new E("packed indices of another version");let o=new Uint32Array(t),e=new Uint32Array(2),r=1;for(let s=0;s<t;s++){let i=0,c,a=0;do{if(r>=n.length)throw new E("packed indices that end too soon");c=n[r++],i|=(c&127)<<a,a+=7}while(c>127);let l=i&1,h=i>>>1;o[s]=e[l]+=h>>>1^-(h&1)}return o}var L=["eye_cap_left","eye_cap_right","skin","mouth_sheet","inside","teeth","tongue"],at=65535;function ct(n){let{document:t,binary:o}=Mt(n),e=t.meshes?.[0],r=t.nodes?.[0]?.scale;(!e||!r||e.extras?.targetNames?.length!==y)&&R("lacks its 52 shapes");let s=r[0]*1e3,i=new Map(e.primitives.map(u=>[t.materials[u.material].name,u])),c=L.filter(u=>i.has(u));L.slice(0,4).some(u=>!i.has(u))&&R("lacks its skin, eyes or mouth");let a=u=>Lt(t,o,u),l=c.map(u=>t.accessors[i.get(u).attributes.POSITION].count),h=l.reduce((u,g)=>u+g,0);h>at&&R(`has ${h} vertices, more than ${at}`);let m=c.map(u=>t.accessors[i.get(u).indices].count),p={positions:new Float32Array(3*h),normals:new Int8Array(4*h),uv:new Float32Array(2*h),part:new Uint8Array(h),indices:new Uint16Array(m.reduce((u,g)=>u+g,0)),shapes:new Int16Array(y*4*h),reach:s,ranges:{}},d=0,f=0;return c.forEach((u,g)=>{let{attributes:w,indices:T,targets:v}=i.get(u),F=a(w.POSITION);for(let x=0;x<F.length;x++)p.positions[3*d+x]=F[x]*s;p.normals.set(a(w.NORMAL),4*d),p.uv.set(a(w.TEXCOORD_0),2*d),p.part.fill(L.indexOf(u),d,d+l[g]);let b=a(T);for(let x=0;x<b.length;x++)b[x]>=l[g]&&R("has a triangle without a corner"),p.indices[f+x]=b[x]+d;v?.length!==y&&R("lacks its 52 shapes"),v.forEach((x,z)=>p.shapes.set(a(x.POSITION),4*(z*h+d))),p.ranges[u]=[f,b.length],d+=l[g],f+=b.length}),p}function R(n){throw new E(`the bundle's web/head.glb ${n}; bake it again`)}function Mt(n){let t=new DataView(n.buffer,n.byteOffset,n.byteLength);(n.length<20||t.getUint32(0,!0)!==1179937895)&&R("is no GLB file");let o=t.getUint32(12,!0);return 20+o+8>n.length&&R("is cut short"),{document:JSON.parse(new TextDecoder().decode(n.subarray(20,20+o))),binary:n.subarray(28+o)}}var St={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Lt(n,t,o){let e=n.accessors[o],r=n.bufferViews[e.bufferView].extensions.EXT_meshopt_compression,{byteOffset:s=0,byteLength:i,byteStride:c,count:a,mode:l}=r;(a!==e.count||a>4*2**20||c>256)&&R("is damaged"),s+i>t.length&&R("is cut short");let h=t.subarray(s,s+i),m=St[e.componentType];return l==="ATTRIBUTES"?new m(H(h,a,c).buffer):m.from($(h,a))}var C=class{constructor(t,o){this.size=o.rest.length,this.known=new Float64Array(t.length*this.size),this.length=new Float64Array(t.length),t.forEach((e,r)=>{this.known.set(e,r*this.size),this.length[r]=Math.hypot(...e)}),this.rest=Float64Array.from(o.rest),this.shapes=o.shapes.map(e=>Float64Array.from(e)),this.moves=this.shapes.map(e=>e.some(r=>r!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(t.length),this.order=Array.from(t,(e,r)=>r),this.count=Math.min(50,t.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(t){let{wanted:o,known:e,score:r,size:s,order:i}=this;o.set(this.rest);for(let f=0;f<t.length;f++){let u=t[f];if(u===0||!this.moves[f])continue;let g=this.shapes[f];for(let w=0;w<s;w++)o[w]+=u*g[w]}let c=0;for(let f=0;f<s;f++)c+=o[f]*o[f];let a=Math.sqrt(c);for(let f=0,u=0;f<r.length;f++){let g=0;for(let w=0;w<s;w++,u++)g+=e[u]*o[w];r[f]=g/(this.length[f]*a)}i.sort((f,u)=>r[u]-r[f]||f-u);let l=1-r[i[0]],h=Math.max(.25*l,1e-4),m=0,p=!1,d=new Float64Array(this.count);for(let f=0;f<this.count;f++)d[f]=Math.exp((l-(1-r[i[f]]))/h),m+=d[f];for(let f=0;f<this.count;f++){let u=d[f]/m;p||=this.index[f]!==i[f]||Math.abs(this.weight[f]-u)>1e-7,this.index[f]=i[f],this.weight[f]=u}return p}};function ht(n,t){let o=0,e=1/0;return n.forEach(([r,s],i)=>{let c=(r-t[0])**2+(s-t[1])**2;c<e&&([o,e]=[i,c])}),o}var lt=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,D=`
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
out vec2 place; // mm: height and depth at rest
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  toward = mat3(view) * normal.xyz;
  place = position.yz;
  gl_Position = projection * (view * vec4(p, 1.0));
}`,gt=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 toward;
in vec3 bent;
in vec2 place;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft;
uniform vec3 light[9];
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
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
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
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
    c *= part == 2u ? ratio : mix(1.0, ratio, 0.5);
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
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
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var O=256;async function Y(n){let{atlases:t,keys:o}=n.description,r=["neutral",...o.map(i=>i.name),"gaze","mouths","masks","coverage","hair","photo"].filter(i=>Object.hasOwn(t,i)),s=await Promise.all(r.map(i=>rt(n,t[i])));return Object.fromEntries(r.map((i,c)=>[i,s[c]]))}var B=class{constructor(t,o,e,r){this.gl=t;let s=t.getParameter(t.MAX_TEXTURE_SIZE);for(let[i,c]of Object.entries(e))if(Math.max(c.width,c.height)>s)throw new E(`${i}: ${c.width} x ${c.height} texels, this device takes ${s}; bake with --preset mobile`);t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.pixelStorei(t.UNPACK_FLIP_Y_WEBGL,!1),this.side=e.neutral.width,this.faces=this.#t(["neutral",...o.keys.map(i=>i.name)].map(i=>e[i])),this.mouths=this.#e(e.mouths,t.RGBA8),this.gaze=this.#e(e.gaze,t.RGBA8),this.coverage=this.#e(e.coverage??V(255),t.RGBA8,!0),this.hairy=!!e.hair,this.hair=this.#e(e.hair??V(0),t.SRGB8_ALPHA8),this.photo=this.#e(e.photo??V(0),t.SRGB8_ALPHA8,!0,!!e.photo),this.masks=this.#s(e.masks,o.atlases.masks),this.#o(r)}#t(t){let{gl:o,side:e}=this,r=U(o,{format:o.SRGB8_ALPHA8,width:e,height:e,layers:t.length});return t.forEach((s,i)=>{if(s.width!==e||s.height!==e)throw new E("face pictures differ in size; bake the bundle again");o.texSubImage3D(o.TEXTURE_2D_ARRAY,0,0,0,i,e,e,1,o.RGBA,o.UNSIGNED_BYTE,s)}),r}#e(t,o,e=!1,r=!1){let{gl:s}=this,i=s.createTexture();s.bindTexture(s.TEXTURE_2D,i);let{width:c,height:a}=t,l=r?Math.floor(Math.log2(Math.max(c,a)))+1:1;s.texStorage2D(s.TEXTURE_2D,l,o,c,a),t.data?s.texSubImage2D(s.TEXTURE_2D,0,0,0,c,a,s.RGBA,s.UNSIGNED_BYTE,t.data):s.texSubImage2D(s.TEXTURE_2D,0,0,0,s.RGBA,s.UNSIGNED_BYTE,t),r&&s.generateMipmap(s.TEXTURE_2D);let h=e?s.LINEAR:s.NEAREST;return s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,r?s.LINEAR_MIPMAP_LINEAR:h),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MAG_FILTER,h),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),i}#s(t,o){let{gl:e}=this,r=t.width/o.columns,s=Math.ceil(y/4),i=this.#e(t,e.RGBA8),c=U(e,{format:e.RGBA8,width:r,height:r,layers:s,linear:!0}),a=new _(e,D,ft),l=e.createFramebuffer();e.bindFramebuffer(e.FRAMEBUFFER,l),e.viewport(0,0,r,r),e.disable(e.DEPTH_TEST),e.disable(e.BLEND),e.disable(e.CULL_FACE),a.use(),a.textures({atlas:[e.TEXTURE_2D,i]}),e.uniform1i(a.at("columns"),o.columns),e.uniform1i(a.at("count"),y),e.uniform1i(a.at("side"),r);for(let h=0;h<s;h++)e.framebufferTextureLayer(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0,c,0,h),e.uniform1i(a.at("first"),4*h),e.drawArrays(e.TRIANGLES,0,3);return e.bindFramebuffer(e.FRAMEBUFFER,null),e.deleteFramebuffer(l),e.deleteTexture(i),e.deleteProgram(a.handle),this.maskSide=r,c}#o(t){let{gl:o}=this,e=t.part.length;this.array=o.createVertexArray(),o.bindVertexArray(this.array);let r=(a,l,h,m,p)=>{o.bindBuffer(o.ARRAY_BUFFER,o.createBuffer()),o.bufferData(o.ARRAY_BUFFER,l,o.STATIC_DRAW),o.enableVertexAttribArray(a),m===o.UNSIGNED_BYTE?o.vertexAttribIPointer(a,h,m,0,0):o.vertexAttribPointer(a,h,m,p,0,0)};r(0,t.positions,3,o.FLOAT,!1),r(1,t.normals,4,o.BYTE,!0),r(2,t.uv,2,o.FLOAT,!1),r(3,t.part,1,o.UNSIGNED_BYTE,!1),o.bindBuffer(o.ELEMENT_ARRAY_BUFFER,o.createBuffer()),o.bufferData(o.ELEMENT_ARRAY_BUFFER,t.indices,o.STATIC_DRAW),o.bindVertexArray(null);let s=Math.ceil(e/O);this.shapes=U(o,{format:o.RGBA16I,width:O,height:s,layers:y});let i=new Int16Array(4*O*s);for(let a=0;a<y;a++)i.set(t.shapes.subarray(4*a*e,4*(a+1)*e)),o.texSubImage3D(o.TEXTURE_2D_ARRAY,0,0,0,a,O,s,1,o.RGBA_INTEGER,o.SHORT,i);this.step=t.reach/32767;let c=a=>a.filter(l=>t.ranges[l]).map(l=>t.ranges[l]);this.runs={image:Et(c(L.slice(0,4))),geometry:Et(c(L.filter(a=>a!=="mouth_sheet")))}}};function Et(n){let t=[];for(let[o,e]of n){let r=t.at(-1);r&&r[0]+r[1]===o?r[1]+=e:t.push([o,e])}return t}var V=n=>({width:1,height:1,data:new Uint8Array(4).fill(n)});function xt(n,t,o,e){let r=n.getExtension("EXT_color_buffer_float")||n.getExtension("EXT_color_buffer_half_float"),s=l=>new k(n,{format:l,width:t,height:t,linear:!0}),i=l=>new k(n,{format:l,width:o,height:o,count:2,linear:!0}),c=r&&{face:s(n.RGBA16F),weights:i(n.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:s(n.SRGB8_ALPHA8),weights:i(n.RGBA8)});let a=new k(n,{format:n.RGBA8,width:e[0],height:e[1]});return{...c,mouth:a}}var Pt=["color","mask","coverage","uv"],Nt=[0,-75,-45],It=46,fe=[32,24];async function ue(n,{canvas:t,antialias:o=!0}){let e=t.getContext("webgl2",{antialias:o,alpha:!1,powerPreference:"high-performance"});if(!e)throw new E("this browser has no WebGL 2; update it, or turn hardware acceleration on");let r=typeof n=="string"?await et(n):n;ot(r.description);let s=yt(e),[i,c]=await Promise.all([Y(r),r.file("head.glb")]);return new j(e,r,i,ct(c),s)}function yt(n){return{weights:new _(n,D,ut),compose:new _(n,D,mt),median:new _(n,D,pt),backdrop:new _(n,D,wt),head:new _(n,dt,gt)}}var j=class{#t;#e;#s;#o;#n;#r;#u=null;#i=null;#m=!1;#a=!0;#c=!0;#w="";#h=new Float32Array(416);#l=new Float32Array(100);#p=new Float32Array(104);constructor(t,o,e,r,s){this.#t=t,this.#e=o,this.#s=r,this.#o=s;let i=o.description;this.about=i,this.expressions=i.expressions,this.canvas=t.canvas,this.weights=new Float32Array(i.expressions.length),this.index=new Map(i.expressions.map((a,l)=>[a,l])),this.hasPhoto=!!i.atlases.photo,this.hasHair=!!i.atlases.hair,this.options={stage:"studio",dynamic:!0,hair:!0,mouth:"image",light:!1,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new C(i.mouths,i.lips),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0};let c=r.positions.reduce((a,l,h)=>h%3===1?Math.min(a,l):a,0);this.bottom=c,this.lips=Ct(r,"mouth_sheet"),this.#E(e),Object.values(e).forEach(a=>a.close()),this.canvas.addEventListener("webglcontextlost",a=>{a.preventDefault(),this.#m=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#v())}#E(t){let o=this.#t,{about:e}=this;this.#n=new B(o,e,t,this.#s);let r=s=>{let{columns:i,rows:c}=e.atlases[s];return[t[s].width/i,t[s].height/c]};this.mouthCell=r("mouths"),this.gazeCell=r("gaze"),this.photoSize=t.photo?[t.photo.width,t.photo.height]:null,this.#r=xt(o,this.#n.side,this.#n.maskSide,this.mouthCell),this.#i=null,this.#a=this.#c=!0,this.mouths.weight.fill(-1)}async#v(){this.#o=yt(this.#t);let t=await Y(this.#e);this.#E(t),Object.values(t).forEach(o=>o.close()),this.#m=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(t){for(let[o,e]of Object.entries(t)){let r=this.index.get(o);if(r===void 0)throw new E(`no expression '${String(o).slice(0,40)}'`);if(!Number.isFinite(e))throw new E(`${o}: ${e} is no weight`);let s=Math.fround(Math.min(Math.max(e,0),1));this.weights[r]!==s&&(this.weights[r]=s,o.startsWith("eyeLook")&&(this.direction=null),this.#a=this.#c=!0)}return this}get(t){return this.weights[this.index.get(t)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#a=this.#c=!0,this}look(t,o){if(!Number.isFinite(t+o))throw new E("gaze is no number");let[e,r]=this.about.eyes.degrees;for(let[s,i]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+s]:Number(i)*t/e,["eyeLookIn"+s]:-Number(i)*t/e,["eyeLookUp"+s]:o/r,["eyeLookDown"+s]:-o/r});return this.direction=[t,o],this}get gaze(){if(this.direction)return this.direction;let[t,o]=this.about.eyes.degrees,e=i=>this.get(i),r=e("eyeLookOutLeft")-e("eyeLookInLeft")-e("eyeLookOutRight")+e("eyeLookInRight"),s=e("eyeLookUpLeft")-e("eyeLookDownLeft")+e("eyeLookUpRight")-e("eyeLookDownRight");return[t*r/2,o*s/2]}turn(t,o,e=0){if(!Number.isFinite(t+o+e))throw new E("a head turn is no number");return this.head=[t,o,e],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(t=this.canvas.width,o=this.canvas.height){let{about:e,orbit:r}=this,s=r.shift.map(h=>h*o);if(this.inPhoto){let{width:h,height:m}=e.photo_camera,p=Math.min(t/h,o/m)*r.zoom;return N(S(e.photo_camera),[h/2,m/2],p,t,o,s)}let i=S(e.front_camera),c=.74*Math.min(t*1.12,o)*r.zoom/i.width,a=[i.width/2,i.height*.5],l=W(N(i,a,c,t,o,s),r.yaw,r.pitch,e.pivot);return this.head.some(Boolean)?K(l,X(...this.head),Nt):l}frontView(t){let o=S(this.about.front_camera);return N(o,[o.width/2,o.height/2],t/o.width,t,t)}eyes(){let t=this.view();return this.about.eyes.centers.map(([o,e,r])=>{let[s,i,c]=Z(t,[o,e,r+11]);return[s,i,13*t.focal/c]})}render(){if(this.#m)return;let t=performance.now();this.#d(),this.#g();let o=this.#t;o.bindFramebuffer(o.FRAMEBUFFER,null),o.viewport(0,0,this.canvas.width,this.canvas.height),this.#x(this.view(),!1),this.stats.milliseconds=performance.now()-t}capture({width:t,height:o,view:e=this.view(t,o)}){let r=this.#t;this.#d(),this.#g();let s=new k(r,{format:r.RGBA8,width:t,height:o,depth:!0});s.bind(),this.#x(e,!0);let i=vt(r,t,o);return s.dispose(),Ot(i,t,o)}mouthSheet(){this.#d(),this.#g();let{mouth:t}=this.#r;return t.bind(),{width:t.width,height:t.height,data:vt(this.#t,t.width,t.height)}}#d(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0})}#g(){let t=this.#t,{dynamic:o,hair:e}=this.options,r=`${o} ${e}`;(this.#a||r!==this.#w)&&(t.disable(t.DEPTH_TEST),t.disable(t.BLEND),t.disable(t.CULL_FACE),this.#y(o,e&&this.#n.hairy),this.mouths.find(this.weights)&&this.#A(),this.#a=!1,this.#w=r),this.inPhoto&&(this.#c||!this.#i)&&this.#T()}#y(t,o){let e=this.#t,{weights:r,compose:s}=this.#o,i=this.#n,{keys:c}=this.about,a=[];this.#h.fill(0);for(let m=0;m<this.weights.length;m++){let p=t?this.weights[m]:0;if(p===0||!c.some(f=>f.weights[m]))continue;let d=m>>2;a.at(-1)!==d&&a.push(d),c.forEach((f,u)=>{this.#h[4*(8*d+u)+(m&3)]=f.weights[m]*p})}this.#r.weights.bind(),r.use(),r.textures({masks:[e.TEXTURE_2D_ARRAY,i.masks]}),e.uniform1i(r.at("groups"),a.length),a.length&&e.uniform1iv(r.at("group"),a),e.uniform4fv(r.at("product"),this.#h),this.#f(4+4*a.length+this.#h.byteLength),this.#r.face.bind(),s.use();let[l,h]=this.#r.weights.textures;s.textures({faces:[e.TEXTURE_2D_ARRAY,i.faces],low:[e.TEXTURE_2D,l],high:[e.TEXTURE_2D,h],hair:[e.TEXTURE_2D,i.hair]}),e.uniform1i(s.at("keys"),a.length?c.length:0),e.uniform1i(s.at("hairy"),Number(o)),this.#f(8),this.stats.compositions++}#A(){let t=this.#t,o=this.#o.median,{mouths:e}=this;for(let r=0;r<e.count;r++)this.#l[2*r]=e.index[r],this.#l[2*r+1]=e.weight[r];this.#r.mouth.bind(),o.use(),o.textures({mouths:[t.TEXTURE_2D,this.#n.mouths]}),t.uniform1i(o.at("columns"),this.about.atlases.mouths.columns),t.uniform1i(o.at("count"),e.count),t.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),t.uniform2fv(o.at("neighbour"),this.#l),this.#f(16+this.#l.byteLength),this.stats.medians++}#T(){let t=this.#t;this.#u??=new I(this.about,this.#s);let{columns:o,rows:e}=this.#u;this.#i??=U(t,{format:t.RG16F,width:o,height:e,linear:!0}),t.bindTexture(t.TEXTURE_2D,this.#i);let r=this.#u.at(this.weights);t.texSubImage2D(t.TEXTURE_2D,0,0,0,o,e,t.RG,t.FLOAT,r),this.#c=!1}#f(t){this.#t.drawArrays(this.#t.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=t}#x(t,o){let e=this.#t,{options:r,about:s}=this,i=this.#n,{backdrop:c,head:a}=this.#o,{inPhoto:l}=this;e.disable(e.BLEND),e.disable(e.CULL_FACE),e.disable(e.DEPTH_TEST);let h=t.focal/s.photo_camera.focal,m=[t.center[0]-s.photo_camera.center[0]*h,t.center[1]-s.photo_camera.center[1]*h,s.photo_camera.width*h,s.photo_camera.height*h],p=l?this.#i:i.hair;c.use(),c.textures({photo:[e.TEXTURE_2D,i.photo],flow:[e.TEXTURE_2D,p]}),e.uniform4fv(c.at("frame"),m),e.uniform2f(c.at("size"),t.width,t.height),e.uniform1i(c.at("inPhoto"),Number(l)),e.uniform1i(c.at("plain"),Number(o&&!l)),e.uniform3fv(c.at("wall"),r.wall),e.uniform3fv(c.at("floorTint"),r.floor),this.#f(56),e.enable(e.DEPTH_TEST),e.clear(e.DEPTH_BUFFER_BIT),e.enable(e.CULL_FACE),o||(e.enable(e.BLEND),e.blendFunc(e.SRC_ALPHA,e.ONE_MINUS_SRC_ALPHA)),a.use(),a.textures({face:[e.TEXTURE_2D,this.#r.face.textures[0]],mouth:[e.TEXTURE_2D,this.#r.mouth.textures[0]],gaze:[e.TEXTURE_2D,i.gaze],coverage:[e.TEXTURE_2D,i.coverage],photo:[e.TEXTURE_2D,i.photo],flow:[e.TEXTURE_2D,p],masks:[e.TEXTURE_2D_ARRAY,i.masks],shapes:[e.TEXTURE_2D_ARRAY,i.shapes]});let d=0;for(let x=0;x<this.weights.length;x++)this.weights[x]!==0&&(this.#p[2*d]=x,this.#p[2*d+++1]=this.weights[x]*i.step);let{gaze:f}=this,u=ht(s.gaze,f),g=2*s.eyes.cap,{columns:w}=s.atlases.gaze,[T,v]=this.gazeCell;e.uniformMatrix4fv(a.at("view"),!1,q(t)),e.uniformMatrix4fv(a.at("projection"),!1,J(t)),e.uniform1i(a.at("count"),d),d&&e.uniform2fv(a.at("moving"),this.#p.subarray(0,2*d));let{uv:F}=s;e.uniform4fv(a.at("places"),[...F.eye_cap_left,...F.eye_cap_right,...F.mouth_sheet]),e.uniform2i(a.at("eyeCell"),T/2,v),e.uniform2i(a.at("eyeCorner"),u%w*T,Math.floor(u/w)*v),e.uniform2f(a.at("slide"),(f[0]-s.gaze[u][0])/g,(s.gaze[u][1]-f[1])/g),e.uniform1i(a.at("layer"),Pt.indexOf(r.layer)),e.uniform1i(a.at("shown"),this.index.get(r.layerExpression)),e.uniform1i(a.at("lit"),Number(r.light&&!l&&!o)),e.uniform1i(a.at("inPhoto"),Number(l)),e.uniform1i(a.at("soft"),+!o),e.uniform1f(a.at("scale"),-t.focal/t.translation[2]),e.uniform3fv(a.at("light"),s.light.flat()),e.uniform1f(a.at("lips"),this.lips),e.uniform2f(a.at("fade"),this.bottom+2,this.bottom+It),e.uniform4fv(a.at("frame"),m),e.uniform1f(a.at("tall"),t.height),this.stats.uniformBytes+=128+8*d+48+24+24+108+8+28,e.bindVertexArray(i.array);let b=r.mouth==="geometry"?i.runs.geometry:i.runs.image;for(let[x,z]of b)e.drawElements(e.TRIANGLES,z,e.UNSIGNED_SHORT,2*x),this.stats.drawCalls++;e.bindVertexArray(null)}dispose(){this.#t.getExtension("WEBGL_lose_context")?.loseContext()}};function Ct(n,t){let[o,e]=n.ranges[t],r=0;for(let s=o;s<o+e;s++)r+=n.positions[3*n.indices[s]+2];return r/e}function vt(n,t,o){let e=new Uint8Array(4*t*o);return n.pixelStorei(n.PACK_ALIGNMENT,1),n.readPixels(0,0,t,o,n.RGBA,n.UNSIGNED_BYTE,e),n.bindFramebuffer(n.FRAMEBUFFER,null),e}function Ot(n,t,o){let e=new Uint8Array(n.length);for(let r=0;r<o;r++)e.set(n.subarray(4*t*r,4*t*(r+1)),4*t*(o-1-r));return e}export{j as Avatar,E as AvatarError,fe as MOST_GAZE,$ as decodeIndices,H as decodeVertices,ue as load,ct as parseHead};
